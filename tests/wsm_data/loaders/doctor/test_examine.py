"""The doctor runs the real loader: what it counts is what was delivered, and what the loader refuses it refuses."""

import numpy as np
import pytest

from wsm_data.access.ranges import open_remote_store
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig
from wsm_data.loaders.doctor.diagnosis import cautions, diagnose
from wsm_data.loaders.doctor.examine import examine, source_facts
from wsm_data.loaders.reading.clip_places import clip_places
from wsm_data.loaders.timing import Part

BATCH = 2


def config(folder, *, ledger="", **read):
    order = OrderConfig(global_batch=BATCH, shuffle=False)
    return LoaderConfig(
        sources=(SourceConfig(release=str(folder)),), order=order, read=ReadConfig(**read), ledger=str(ledger)
    )


def look(folder, *, batches=3, seconds=30.0, **settings):
    return examine(config(folder, **settings), batches=batches, seconds=seconds)


@pytest.mark.parametrize("settings", [{}, {"threads": 0}, {"standardise": False, "dtype": "float16"}], ids=str)
def test_clips_and_bytes_are_those_behind_the_first_batch(released, make_loader, settings):
    run, _ = look(released.folder, **settings)
    loader = make_loader(global_batch=BATCH, shuffle=False)
    refs = np.concatenate([np.concatenate(loader.epoch_order.rows(step, 0, 1)) for step in (1, 2, 3)])
    places = clip_places(loader.sources, refs)
    # a clip of F latents has 1 + 4 (F - 1) poses; the slots of a batch have 4 F, three more of 28 bytes
    assert run.clips == 3 * BATCH
    assert run.stored_bytes == sum(sum(place.sizes) + 3 * 28 for place in places)


def test_it_goes_on_into_the_next_epoch_until_it_has_enough(released):
    run, _ = look(released.folder, batches=40)
    assert run.clips == 40 * BATCH > len(released.clips)


def test_it_stops_when_the_time_is_over(released):
    run, _ = look(released.folder, batches=10**9, seconds=0.2)
    assert 0.2 <= run.elapsed_s < 20  # on a machine as busy as it may be


def test_the_parts_of_the_time_are_all_there_and_fit_into_it(released):
    run, _ = look(released.folder, batches=20, threads=0)
    assert set(run.seconds) == set(Part)
    assert all(seconds >= 0 for seconds in run.seconds.values())
    assert run.seconds[Part.STORE] > 0
    assert sum(run.seconds.values()) - run.seconds[Part.WAIT] <= run.elapsed_s
    assert run.first_batch_s > 0
    assert run.limit_bytes_per_s > 0


def test_a_training_step_takes_its_time(released):
    run, _ = examine(config(released.folder), batches=4, seconds=30.0, step_s=0.02)
    assert run.step_s == 0.02
    assert run.elapsed_s >= 4 * 0.02


def test_rank_0_of_several_has_its_share_of_each_step(released):
    run, facts = examine(config(released.folder), batches=3, seconds=30.0, ranks=BATCH)
    assert run.clips == 3
    assert facts == examine(config(released.folder), batches=1, seconds=30.0)[1]
    with pytest.raises(ConfigError, match="global_batch"):
        examine(config(released.folder), batches=3, seconds=30.0, ranks=BATCH + 1)


def test_connections_of_the_measured_limit_are_closed(remote, monkeypatch):
    opened = []

    def noted(*arguments):
        opened.append(open_remote_store(*arguments))
        return opened[-1]

    monkeypatch.setattr("wsm_data.loaders.doctor.examine.open_remote_store", noted)
    look(remote.url, batches=1, seconds=20.0)
    assert [store._closed.is_set() for store in opened] == [True]


def test_its_diagnosis_is_a_sentence_about_the_run(released):
    settings = config(released.folder)
    run, facts = examine(settings, batches=5, seconds=30.0)
    assert diagnose(run, settings.read).endswith(".")
    assert all("few" not in caution for caution in cautions(facts, settings.order))  # shards of 0.3 MB


def test_shards_and_padding_are_counted_from_release_and_order(released, make_loader):
    loader = make_loader(global_batch=BATCH, remainder=Remainder.PAD)
    facts = source_facts(loader)
    train = [shard for shard in released.release.manifest.shards if shard.split == "train"]
    assert (facts.shards, facts.shard_bytes) == (len(train), sum(shard.bytes for shard in train))
    assert facts.padding_share == loader.summary.padding_share > 0
    assert facts.longest_latents == max(len(clip.rgb_latent) for clip in released.clips.values())
    assert not facts.remote


def test_a_ledger_of_the_run_is_not_touched(released, tmp_path):
    look(released.folder, ledger=tmp_path / "ledger")
    assert not (tmp_path / "ledger").exists()


def test_a_damaged_shard_is_named_not_measured(released, tmp_path):
    folder = released.copied(tmp_path / "release")
    for shard in folder.glob("train-*.tar"):
        data = bytearray(shard.read_bytes())
        data[3000] ^= 1  # in the first array of the first clip
        shard.write_bytes(data)
    with pytest.raises(IntegrityError, match="train-0000"):
        look(folder, batches=40)


def test_a_release_behind_a_url_is_measured_against_one_stream_of_the_store(remote):
    run, facts = look(remote.url, batches=2, seconds=20.0)
    assert run.remote
    assert facts.remote
    assert run.limit_bytes_per_s > 0
    assert run.clips == 2 * BATCH
