import gc
import json
import pickle
import threading
from contextlib import suppress
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import torch

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.ledger.timeline import read_timeline
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.timing import Part

STORED = {"standardise": False, "dtype": "float16"}


def _refs(loader: ClipLoader, count: int | None = None) -> list[list[int]]:
    return [batch.refs.tolist() for batch in islice(loader, count)]


def test_an_epoch_is_as_ordered_and_the_next_one_follows(make_loader):
    loader = make_loader()
    for epoch in range(3):
        ordered = [np.concatenate(loader.epoch_order.rows(step, 0, 1)).tolist() for step in range(loader.steps)]
        batches = [(batch.epoch, batch.step, batch.refs.tolist()) for batch in loader]
        assert batches == [(epoch, step, refs) for step, refs in enumerate(ordered)]
        assert loader.state_dict()["epoch"] == epoch + 1


@pytest.mark.parametrize("threads", [0, 2])
def test_a_kept_batch_is_never_overwritten(make_loader, threads):
    """All batches of three epochs at once hold what they held one by one, while buffers are used again."""
    one_by_one = make_loader(**STORED, threads=threads)
    digests = [batch.rgb.numpy().tobytes() for _ in range(3) for batch in one_by_one]
    loader = make_loader(**STORED, threads=threads)
    kept = [batch for _ in range(3) for batch in list(loader)]
    assert [batch.rgb.numpy().tobytes() for batch in kept] == digests


def test_the_state_is_small_json_and_counts_delivered_batches_only(make_loader):
    loader = make_loader(threads=2, prefetch_batches=4)
    before = loader.state_dict()
    iterator = iter(loader)
    assert loader.state_dict() == before  # a stray iterator changes nothing
    for step in range(3):
        next(iterator)
        state = loader.state_dict()
        assert (state["epoch"], state["step"]) == (0, step + 1)
        assert json.loads(json.dumps(state)) == state
    assert len(json.dumps(loader.state_dict())) < 1000


def test_a_stray_iterator_does_not_disturb_the_one_that_runs(make_loader):
    loader = make_loader()
    expected = _refs(make_loader())
    found = []
    for batch in loader:
        iter(loader)
        found.append(batch.refs.tolist())
    assert found == expected


def test_an_iterator_that_was_overtaken_says_so(make_loader):
    loader = make_loader(threads=1)
    old, new = iter(loader), iter(loader)
    first = next(old)
    second = next(new)
    assert (first.step, second.step) == (0, 1)
    with pytest.raises(RuntimeError, match="this iterator was overtaken"):
        next(old)
    assert next(new).step == 2


@pytest.mark.parametrize("change", ["load_state_dict", "set_epoch", "close"])
def test_an_iterator_over_a_loader_that_was_moved_says_so(make_loader, change):
    loader = make_loader()
    state = loader.state_dict()
    iterator = iter(loader)
    next(iterator)
    {"load_state_dict": lambda: loader.load_state_dict(state), "set_epoch": lambda: loader.set_epoch(5)}.get(
        change, loader.close
    )()
    with pytest.raises(RuntimeError, match="overtaken"):
        next(iterator)
    assert _refs(loader)  # a new iterator works, also after closing


def test_the_epoch_that_the_loader_is_in_is_not_begun_again(make_loader):
    """What training loops say at the start of each epoch must not undo a resume."""
    loader = make_loader()
    _refs(loader, 2)
    loader.set_epoch(0)
    assert loader.state_dict()["step"] == 2
    loader.set_epoch(4)
    assert (loader.state_dict()["epoch"], loader.state_dict()["step"]) == (4, 0)
    with pytest.raises(ValueError, match="epoch must be at least 0"):
        loader.set_epoch(-1)


def test_a_state_at_the_end_of_an_epoch_gives_the_empty_rest_then_the_next_epoch(make_loader):
    loader = make_loader()
    steps, next_epoch = loader.steps, [_refs(loader), _refs(loader)][1]
    resumed = make_loader()
    resumed.load_state_dict(make_loader().state_dict() | {"step": steps})
    assert _refs(resumed) == []
    assert _refs(resumed) == next_epoch


def test_a_state_behind_the_end_is_refused(make_loader):
    loader = make_loader()
    with pytest.raises(ConfigError, match=f"epoch 0 has {loader.steps} steps, but the state stands at step 99"):
        loader.load_state_dict(loader.state_dict() | {"step": 99})


def test_a_state_of_another_order_is_refused_field_by_field(make_loader):
    with pytest.raises(ConfigError, match=r"order.seed: 3 -> 4"):
        make_loader(seed=4).load_state_dict(make_loader().state_dict())


@pytest.mark.parametrize("threads", [0, 1, 4])
def test_damage_is_raised_at_its_step_after_all_good_ones(released, make_loader, tmp_path, threads):
    folder = released.copied(tmp_path / "release")
    loader = make_loader(folder, threads=threads, prefetch_batches=4)
    expected = _refs(make_loader())
    place = loader.sources.tables[0].index_row(expected[4][0])
    path = folder / place.shard
    data = bytearray(path.read_bytes())
    data[place.clip_offset + place.members[0].array_offset] ^= 1
    path.write_bytes(data)
    found = []
    with pytest.raises(IntegrityError, match=f"clip {place.key}"):
        found.extend(batch.refs.tolist() for batch in loader)
    assert loader.state_dict()["step"] == 4  # the bad step was not delivered: mended, the run goes on there


def _wsm_threads() -> int:
    return sum(thread.name.startswith("wsm-loader") for thread in threading.enumerate())


def test_threads_end_with_the_epoch_when_the_caller_breaks_off_and_on_closing(make_loader):
    loader = make_loader(threads=3)
    _refs(loader)
    assert _wsm_threads() == 0
    for _ in loader:
        break
    gc.collect()
    assert _wsm_threads() == 0
    iterator = iter(loader)
    next(iterator)
    assert _wsm_threads() > 0
    loader.close()
    assert _wsm_threads() == 0


def test_settings_that_contradict_the_machine_or_the_ranks_are_refused_at_once(released, make_loader):
    with pytest.raises(ConfigError, match="must divide global_batch = 4, found 3"):
        make_loader(rank=0, world_size=3)
    with pytest.raises(ConfigError, match="device must be 'cpu' or a CUDA device"):
        make_loader(device="abacus")
    with pytest.raises(ConfigError, match="there is no release"):
        ClipLoader(LoaderConfig(sources=(SourceConfig(release=str(released.folder / "no")),)))


def test_time_is_counted_to_its_parts(make_loader):
    loader = make_loader()
    _refs(loader)
    seconds = loader.timing.seconds()
    assert all(seconds[part] > 0 for part in (Part.STORE, Part.CHECKSUM, Part.COLLATE, Part.WAIT))


def test_what_is_delivered_is_recorded_in_the_ledger(make_loader, tmp_path):
    loader = make_loader(ledger=str(tmp_path / "ledger"))
    delivered = _refs(loader, 2) + _refs(loader)
    loader.close()
    [epoch] = read_timeline(tmp_path / "ledger").epochs
    assert [(step, refs.tolist()) for step, (refs,) in epoch.by_step()] == list(enumerate(delivered))


def test_a_loader_crosses_to_another_process_with_its_place(make_loader):
    loader = make_loader()
    expected = _refs(make_loader())
    _refs(loader, 2)
    with pickle.loads(pickle.dumps(loader)) as copy:  # noqa: S301
        assert _refs(copy) == expected[2:]


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_workers_of_a_dataloader_deal_the_steps_among_them(make_loader, workers):
    expected = _refs(make_loader())
    loader = make_loader()
    _refs(loader, 1)
    outer = torch.utils.data.DataLoader(loader, batch_size=None, num_workers=workers)
    found = {batch.step: batch.refs.tolist() for batch in outer}
    assert [found[step] for step in sorted(found)] == expected[1:]


def _pass_of(outer: torch.utils.data.DataLoader) -> list[tuple[int, int, list[int]]]:
    return sorted((batch.epoch, batch.step, batch.refs.tolist()) for batch in outer)


def test_workers_of_a_dataloader_are_at_the_epoch_that_the_loader_is_told(make_loader):
    """Every pass has new copies of the loader, which itself never moves."""
    alone, loader = make_loader(), make_loader()
    expected = [sorted((batch.epoch, batch.step, batch.refs.tolist()) for batch in alone) for _ in range(2)]
    outer = torch.utils.data.DataLoader(loader, batch_size=None, num_workers=2)
    found = []
    for epoch in range(2):
        loader.set_epoch(epoch)
        found.append(_pass_of(outer))
    assert found == expected
    assert _pass_of(outer) == expected[1]  # nobody said otherwise
    assert (loader.state_dict()["epoch"], loader.state_dict()["step"]) == (1, 0)


def test_persistent_workers_of_a_dataloader_move_on_by_themselves(make_loader):
    alone = make_loader()
    expected = [sorted((batch.epoch, batch.step, batch.refs.tolist()) for batch in alone) for _ in range(2)]
    outer = torch.utils.data.DataLoader(make_loader(), batch_size=None, num_workers=2, persistent_workers=True)
    assert [_pass_of(outer), _pass_of(outer)] == expected


def test_inside_a_dataloader_only_what_works_there_is_allowed(make_loader, tmp_path):
    outer = torch.utils.data.DataLoader(make_loader(ledger=str(tmp_path / "ledger")), batch_size=None, num_workers=1)
    with pytest.raises(ConfigError, match="must leave these settings out, found ledger"):
        next(iter(outer))


@pytest.mark.slow
def test_the_goal_is_that_of_the_meta_data(tmp_path, make_source, run_pipeline):
    """On clips of the pipeline: the last pose is the goal in the first camera's frame, rounded to float32."""
    run_pipeline(make_source(trajectories=1, cameras=("d435i",)), tmp_path)
    config = LoaderConfig(
        sources=(SourceConfig(release=str(tmp_path / "pack" / "release"), split=""),), order=OrderConfig(global_batch=1)
    )
    with ClipLoader(config) as loader:
        release = loader.sources.tables[0].release
        for batch in loader:
            goal = np.array(release.read_clip(batch.keys[0]).meta.goal_camera0_m)
            np.testing.assert_allclose(batch.goal_camera0_m[0].numpy(), goal, rtol=2**-24, atol=1e-30)


def _open_below(folder: Path) -> set[str]:
    names = set()
    for link in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # that of the listing itself
            names.add(str(link.readlink()))
    return {name for name in names if name.startswith(f"{folder}/")}


def test_no_file_of_a_closed_loader_stays_open(released, make_loader, tmp_path):
    folder = released.copied(tmp_path / "release")
    loader = make_loader(folder)
    _refs(loader)
    assert _open_below(folder)
    loader.close()
    assert _open_below(folder) == set()


def test_the_place_of_a_release_is_enough(released):
    loader = ClipLoader(released.folder, batch=3)
    batches = list(loader)
    assert len(batches) == len(loader) > 0
    assert {len(batch.rgb) for batch in batches} == {3}
    assert "clips in 3 rows" in repr(batches[0])
    with pytest.raises(ConfigError, match="batch goes with the path"):
        ClipLoader(LoaderConfig(sources=(SourceConfig(release=str(released.folder)),)), batch=3)


def test_a_batch_goes_to_a_device_with_all_its_tensors(make_loader):
    batch = next(iter(make_loader()))
    moved = batch.to("meta")
    assert {moved.rgb.device.type, moved.goal_camera0_m.device.type, moved.depth_valid.device.type} == {"meta"}
    assert moved.keys == batch.keys
    assert moved.rgb.shape == batch.rgb.shape
