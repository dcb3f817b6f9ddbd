import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch
import torch.utils.data

from wsm_data.access.config import RemoteAccess
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.geometry.transform import transforms_from_vectors
from wsm_data.loaders.config import Arrangement, LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig, Verify
from wsm_data.loaders.ledger.audit import audit_epochs
from wsm_data.loaders.ledger.sources import open_recorded_sources
from wsm_data.loaders.ledger.timeline import read_timeline
from wsm_data.loaders.queries import QueryLoader
from wsm_data.loaders.sources.queries import QueryConfig

TWO = QueryConfig(queries_per_clip=2, future_latents=2)


@pytest.fixture
def driven(tmp_path, make_clip, tiny):
    """Six clips of seven to twelve latents, each on a map of its own size and place."""
    clips = {}
    for number in range(6):
        turn = transforms_from_vectors(np.array([1.0 + number, 2, 0.5, np.cos(0.3), 0, 0, np.sin(0.3)]))
        clip = make_clip(
            f"synth_d435i/home_0001/{number:06d}",
            latents=7 + number,
            map_origin_cell=(number - 3, 2 * number),
            T_world_camera0=tuple(map(tuple, turn.tolist())),
            goal_radius_m=0.2 + number / 100,
        )
        clips[clip.meta.key] = clip
    tiny.pack(tmp_path / "driven", list(clips.values()), shard_bytes=700_000)
    return str(tmp_path / "driven"), clips


def config_of(release, *, read=None, ledger="", **order):
    settings = {"seed": 4, "global_batch": 2, "remainder": Remainder.PAD} | order
    return LoaderConfig(
        sources=(SourceConfig(release=release),),
        order=OrderConfig(**settings),
        read=read or ReadConfig(standardise=False, dtype="float16"),
        ledger=ledger,
    )


def seen(batches):
    """What was asked: clip and replan latent of each query, in order."""
    return [pair for batch in batches for pair in zip(batch.history.keys, batch.replan_latent.tolist(), strict=True)]


@pytest.mark.parametrize("arrangement", list(Arrangement))
def test_a_query_is_a_prefix_of_its_clip_with_its_map(driven, arrangement):
    release, clips = driven
    order = {"arrangement": arrangement, "row_latents": 24 if arrangement is Arrangement.JOIN else 0}
    count = 0
    with QueryLoader(config_of(release, **order), TWO) as loader:
        for batch in loader:
            history = batch.history
            for n, key in enumerate(history.keys):
                clip, replan, count = clips[key], int(batch.replan_latent[n]), count + 1
                row, own = history.spans[n].place
                assert history.spans[n].length == replan + 1
                np.testing.assert_array_equal(history.rgb[row, own].numpy(), clip.rgb_latent[: replan + 1])
                np.testing.assert_array_equal(history.depth[row, own].numpy(), clip.depth_latent[: replan + 1])
                np.testing.assert_array_equal(history.goal_camera0_m[n].numpy(), clip.poses[-1, :3])
                rows, columns = clip.occupancy.shape
                assert batch.map_shape[n].tolist() == [rows, columns]
                np.testing.assert_array_equal(batch.occupancy[n, :rows, :columns].numpy(), clip.occupancy)
                np.testing.assert_array_equal(batch.geodesic_mm[n, :rows, :columns].numpy(), clip.geodesic_mm)
                beyond = np.ones(batch.occupancy.shape[1:], bool)
                beyond[:rows, :columns] = False
                assert (batch.occupancy[n].numpy()[beyond] == 255).all()
                assert (batch.geodesic_mm[n].numpy()[beyond] == 65535).all()
    assert count == 12


def test_a_query_stands_where_the_camera_was_at_its_last_frame(driven):
    release, clips = driven
    with QueryLoader(config_of(release), TWO) as loader:
        for batch in loader:
            for n, key in enumerate(batch.history.keys):
                clip, frame = clips[key], 4 * int(batch.replan_latent[n])
                meta = clip.meta
                T_world_camera0 = np.array(meta.T_world_camera0)
                np.testing.assert_array_equal(batch.T_world_camera0[n].numpy(), T_world_camera0)
                expected = T_world_camera0 @ transforms_from_vectors(clip.poses[frame])
                np.testing.assert_allclose(batch.T_world_camera[n].numpy(), expected, rtol=0, atol=1e-12)
                np.testing.assert_array_equal(
                    batch.expert_distance_m[n].numpy(), clip.expert_distance[frame : frame + 9]
                )
                assert batch.goal_world_m[n].tolist() == list(meta.goal_world_m)
                assert batch.goal_radius_m[n].item() == meta.goal_radius_m
                assert batch.robot_radius_m[n].item() == meta.robot_radius_m
                assert batch.resolution_m[n].item() == meta.map_resolution_m
                assert batch.map_of(n).grid.origin_cell == meta.map_origin_cell


def test_every_clip_is_asked_as_often_in_each_epoch_at_other_latents(driven):
    release, clips = driven
    with QueryLoader(config_of(release), TWO) as loader:
        epochs = [seen(loader) for _ in range(3)]
    for asked in epochs:
        assert sorted(key for key, _ in asked) == sorted(key for key in clips for _ in range(2))
        assert len(set(asked)) == 12
    assert len({frozenset(asked) for asked in epochs}) == 3


@pytest.mark.parametrize("world_size", [1, 2, 4])
def test_the_ranks_together_ask_the_same_for_every_world_size(driven, world_size):
    release, _ = driven
    config = config_of(release, global_batch=4)
    with QueryLoader(config, TWO, rank=0, world_size=1) as alone:
        expected = [seen([batch]) for batch in alone]
    loaders = [QueryLoader(config, TWO, rank=rank, world_size=world_size) for rank in range(world_size)]
    for step, batches in enumerate(zip(*loaders, strict=True)):
        assert seen(batches) == expected[step]
    for loader in loaders:
        loader.close()


@pytest.mark.parametrize("delivered", range(7))
def test_a_state_goes_on_where_it_was_taken_also_on_another_world_size(driven, delivered):
    release, _ = driven
    with QueryLoader(config_of(release), TWO) as loader:
        whole = [seen([batch]) for batch in itertools.chain(loader, loader)]
    with QueryLoader(config_of(release), TWO) as loader:
        taken = [seen([batch]) for batch in itertools.islice(loader, delivered)]
        state = loader.state_dict()
    assert taken == whole[:delivered]
    halves = [QueryLoader(config_of(release), TWO, rank=rank, world_size=2) for rank in range(2)]
    for half in halves:
        half.load_state_dict(state)
    rest = [seen(pair) for _ in range(2) for pair in zip(*halves, strict=True)]
    for half in halves:
        half.close()
    assert rest == whole[delivered:]


def test_other_queries_are_another_order(driven):
    release, _ = driven
    with QueryLoader(config_of(release), TWO) as loader:
        state = loader.state_dict()
    with (
        QueryLoader(config_of(release), replace(TWO, future_latents=1)) as loader,
        pytest.raises(ConfigError, match=r"queries\.future_latents: 2 -> 1"),
    ):
        loader.load_state_dict(state)


@pytest.mark.parametrize("arrangement", list(Arrangement))
def test_the_ledger_of_queries_is_proven_by_their_order(driven, tmp_path, arrangement):
    release, _ = driven
    order = {"arrangement": arrangement, "row_latents": 24 if arrangement is Arrangement.JOIN else 0}
    with QueryLoader(config_of(release, ledger=str(tmp_path / "ledger"), **order), TWO) as loader:
        for _ in range(2):
            assert len(list(loader)) == loader.steps == loader.summary.steps
    timeline = read_timeline(tmp_path / "ledger")
    sources = open_recorded_sources(timeline.identity, [release], [])
    audits = audit_epochs(timeline, sources)
    assert [(audit.complete, audit.seen_once, audit.never, audit.misfits) for audit in audits] == [
        (True, 12, 0, ())
    ] * 2


@pytest.mark.parametrize("workers", [0, 2])
def test_worker_processes_of_a_data_loader_give_the_same(driven, workers):
    release, _ = driven
    with QueryLoader(config_of(release), TWO) as loader:
        loader.set_epoch(1)
        expected = seen(loader)
        loader.set_epoch(1)
        batches = torch.utils.data.DataLoader(loader, batch_size=None, num_workers=workers)
        assert seen(batches) == expected


def damage_map(release, query):
    """Change a byte of the map of a query; returns the row of its clip."""
    with QueryLoader(config_of(release), TWO) as loader:
        row = loader.sources.tables[0].index_row(query)
    [member] = [member for member in row.members if member.name == "geodesic_mm"]
    with open(f"{release}/{row.shard}", "r+b") as file:  # noqa: PTH123  # a path of the store, not of a test
        file.seek(row.clip_offset + member.array_offset)
        byte = file.read(1)
        file.seek(-1, 1)
        file.write(bytes([byte[0] ^ 1]))
    return row


@pytest.mark.parametrize("reading", [{"threads": 0}, {"threads": 2, "prefetch_batches": 4}], ids=str)
def test_a_step_whose_map_is_damaged_is_neither_counted_nor_recorded(driven, tmp_path, reading):
    """Two queries a clip and two a step: in the order of the index, step 3 has the fourth clip."""
    release, _ = driven
    row = damage_map(release, 6)
    config = config_of(release, shuffle=False, ledger=str(tmp_path / "ledger"), read=ReadConfig(**reading))
    delivered = []
    with QueryLoader(config, TWO) as loader:
        with pytest.raises(IntegrityError, match=row.key):
            delivered.extend(loader)
        assert len(delivered) == loader.state_dict()["step"] == 3
    [epoch] = read_timeline(tmp_path / "ledger").epochs
    assert [step for step, _ in epoch.by_step()] == [0, 1, 2]


def test_damage_of_a_map_is_named(driven):
    release, _ = driven
    row = damage_map(release, 0)
    with (
        QueryLoader(config_of(release), TWO) as loader,
        pytest.raises(IntegrityError, match=rf"{row.shard}, clip {row.key}: the checksum of geodesic_mm\.npy"),
    ):
        list(loader)
    with QueryLoader(config_of(release, read=ReadConfig(verify=Verify.NEVER)), TWO) as loader:
        assert len(list(loader)) == 6


def test_a_rank_may_have_no_query_in_a_step(driven):
    """12 queries in two steps of 8 leave four slots empty."""
    release, _ = driven
    sizes = []
    for rank in range(8):
        with QueryLoader(config_of(release, global_batch=8), TWO, rank=rank, world_size=8) as loader:
            sizes += [(len(batch.replan_latent), len(batch.occupancy), len(batch.T_world_camera)) for batch in loader]
    assert sorted(sizes) == [(0, 0, 0)] * 4 + [(1, 1, 1)] * 12


@pytest.mark.parametrize("access", list(RemoteAccess))
def test_a_release_behind_a_url_gives_the_same_queries(remote, tmp_path, access):
    short = QueryConfig(future_latents=1)
    local = replace(config_of(str(remote.published.folder)), read=ReadConfig(standardise=False))
    url = replace(config_of(remote.url), read=remote.read(access=access, cache_dir=str(tmp_path), standardise=False))
    with QueryLoader(local, short) as near, QueryLoader(url, short) as far:
        for one, other in zip(near, far, strict=True):
            assert seen([one]) == seen([other])
            for name in ("occupancy", "geodesic_mm", "T_world_camera", "expert_distance_m"):
                assert torch.equal(getattr(one, name), getattr(other, name))


def test_a_clip_whose_map_is_its_own_path_answers_no_query(tmp_path, make_clip, tiny):
    clips = [make_clip(f"synth_d435i/home_0001/{number:06d}", latents=8, map_from="path") for number in range(2)]
    tiny.pack(tmp_path / "strips", clips, shard_bytes=700_000)
    with (
        QueryLoader(config_of(str(tmp_path / "strips")), TWO) as loader,
        pytest.raises(ConfigError, match="must have a map, but its source had neither"),
    ):
        next(iter(loader))
