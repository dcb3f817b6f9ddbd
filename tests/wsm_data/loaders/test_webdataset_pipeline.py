import gc
import json
import warnings
from io import BytesIO

import numpy as np
import pytest
import torch.utils.data
import webdataset
from fault_proxy import Fault

from wsm_data.access.config import RemoteAccess
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.config import Arrangement, OrderConfig, ReadConfig, Remainder, SourceConfig, Verify
from wsm_data.loaders.order.epoch_order import order_epoch
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.webdataset_pipeline import as_webdataset

PAIRS = OrderConfig(seed=3, global_batch=2, remainder=Remainder.PAD, block_clips=1)


def stock_samples(folder):
    """Every sample of every shard, by key, as stock webdataset reads them."""
    urls = sorted(str(path) for path in folder.glob("*.tar"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves the shards open
        samples = {sample["__key__"]: sample for sample in webdataset.WebDataset(urls, shardshuffle=False)}
        gc.collect()
    return samples


def keys(pipeline):
    return [sample["__key__"] for sample in pipeline]


def ordered_keys(folder, order, epoch, *, split="train", rank=0, world_size=1):
    sources = open_sources([SourceConfig(release=str(folder), split=split)])
    epoch_order = order_epoch(sources.layouts, order, epoch)
    return [
        key
        for step in range(epoch_order.steps)
        for row in epoch_order.rows(step, rank, world_size)
        for key in sources.keys(row)
    ]


@pytest.mark.parametrize("shuffle", [True, False])
@pytest.mark.parametrize("verify", list(Verify))
def test_every_sample_is_what_stock_webdataset_reads(tiny, shuffle, verify):
    order = OrderConfig(global_batch=1, shuffle=shuffle)
    samples = list(as_webdataset(str(tiny.folder), split="", order=order, read=ReadConfig(verify=verify)))
    stock = stock_samples(tiny.folder)
    assert sorted(sample["__key__"] for sample in samples) == sorted(stock)
    for sample in samples:
        assert sample == stock[sample["__key__"]]
    if not shuffle:
        assert [sample["__key__"] for sample in samples] == list(stock)


def test_the_order_is_that_of_the_loader_and_each_pass_is_the_next_epoch(tiny):
    pipeline = as_webdataset(str(tiny.folder), order=PAIRS)
    passes = [keys(pipeline) for _ in range(4)]
    assert passes == [ordered_keys(tiny.folder, PAIRS, epoch) for epoch in range(4)]
    assert len({tuple(one) for one in passes}) > 1
    pipeline.set_epoch(1)
    assert keys(pipeline) == passes[1]
    with pytest.raises(ValueError, match="at least 0"):
        pipeline.set_epoch(-1)


def test_a_pass_that_is_not_taken_to_its_end_begins_again(tiny):
    pipeline = as_webdataset(str(tiny.folder), order=PAIRS)
    assert next(iter(pipeline))["__key__"] == keys(pipeline)[0]


@pytest.mark.parametrize("world_size", [1, 2])
@pytest.mark.parametrize("workers", [0, 1, 2])
def test_ranks_and_workers_share_the_samples(tiny, world_size, workers):
    found = []
    for rank in range(world_size):
        pipeline = as_webdataset(str(tiny.folder), order=PAIRS, rank=rank, world_size=world_size)
        pipeline.set_epoch(2)
        loader = torch.utils.data.DataLoader(
            pipeline.to_tuple("__key__").batched(2 // world_size, partial=True), batch_size=None, num_workers=workers
        )
        delivered = [key for [batch] in loader for key in batch]
        if not workers:
            assert delivered == ordered_keys(tiny.folder, PAIRS, 2, rank=rank, world_size=world_size)
        found += delivered
    assert sorted(found) == sorted(ordered_keys(tiny.folder, PAIRS, 2))


def test_workers_deliver_batches_in_the_order_of_the_steps(tiny):
    """Of five clips, without the remainder, there are two full steps: one from each worker."""
    order = OrderConfig(seed=3, global_batch=2)
    pipeline = as_webdataset(str(tiny.folder), order=order).to_tuple("__key__").batched(2)
    for epoch in range(3):
        pipeline.set_epoch(epoch)
        loader = torch.utils.data.DataLoader(pipeline, batch_size=None, num_workers=2)
        batches = [list(batch) for [batch] in loader]
        expected = ordered_keys(tiny.folder, order, epoch)
        assert batches == [expected[:2], expected[2:]]
        assert [list(batch) for [batch] in pipeline] == batches


def test_further_steps_of_a_pipeline_work(tiny):
    pipeline = (
        as_webdataset(str(tiny.folder), order=PAIRS)
        .decode()
        .map(lambda sample: sample | {"first": sample["rgb_latent.npy"][0]})
        .to_tuple("__key__", "first", "meta.json")
        .batched(2)
    )
    clips = {clip.meta.key: clip for clip in tiny.clips}
    seen = 0
    for names, first, meta in pipeline:
        for name, latent, record in zip(names, first, meta, strict=True):
            np.testing.assert_array_equal(np.asarray(latent), clips[name].rgb_latent[0])
            assert record["source_digest"] == clips[name].meta.source_digest
            seen += 1
    assert seen == 5


def test_members_are_plain_npy_files_and_json(tiny):
    sample = next(iter(as_webdataset(str(tiny.folder), order=PAIRS)))
    [clip] = [clip for clip in tiny.clips if clip.meta.key == sample["__key__"]]
    np.testing.assert_array_equal(np.load(BytesIO(sample["poses.npy"]), allow_pickle=False), clip.poses)
    assert json.loads(sample["meta.json"])["key"] == clip.meta.key


def spoil(tiny, name="geodesic_mm"):
    """Change one byte of one member of the first clip of the index; returns its shard and key."""
    row = open_sources([SourceConfig(release=str(tiny.folder), split="")]).tables[0].index_row(0)
    [member] = [member for member in row.members if member.name == name]
    path = tiny.folder / row.shard
    data = bytearray(path.read_bytes())
    data[row.clip_offset + member.array_offset] ^= 1
    path.write_bytes(data)
    return row


def test_a_damaged_member_is_named_wherever_it_stands(tiny):
    row = spoil(tiny)
    with pytest.raises(IntegrityError, match=rf"{row.shard}, clip {row.key}: the checksum of geodesic_mm\.npy must be"):
        list(as_webdataset(str(tiny.folder), split="", order=PAIRS))


def test_without_verification_a_damaged_member_is_delivered_as_it_is(tiny):
    row = spoil(tiny)
    pipeline = as_webdataset(str(tiny.folder), split="", order=PAIRS, read=ReadConfig(verify=Verify.NEVER))
    samples = {sample["__key__"]: sample for sample in pipeline}
    assert samples[row.key] == stock_samples(tiny.folder)[row.key]


def test_a_shard_that_was_cut_is_named(tiny):
    row = open_sources([SourceConfig(release=str(tiny.folder), split="")]).tables[0].index_row(0)
    path = tiny.folder / row.shard
    path.write_bytes(path.read_bytes()[: row.clip_offset + row.clip_size - 1024])
    with pytest.raises(IntegrityError, match=row.shard):
        list(as_webdataset(str(tiny.folder), split="", order=PAIRS))


@pytest.mark.parametrize(
    "order",
    [OrderConfig(arrangement=Arrangement.JOIN, row_latents=8), OrderConfig(max_latents=4)],
    ids=["packed", "cut"],
)
def test_an_order_that_packs_or_cuts_clips_is_refused(tiny, order):
    with pytest.raises(ConfigError, match="whole clips one by one"):
        as_webdataset(str(tiny.folder), order=order)


def test_what_is_not_there_is_refused_before_anything_is_read(tiny):
    with pytest.raises(ConfigError, match="split 'night'"):
        as_webdataset(str(tiny.folder), split="night")
    with pytest.raises(ConfigError, match="divide global_batch"):
        as_webdataset(str(tiny.folder), rank=0, world_size=3)


def test_a_closed_pipeline_leaves_nothing_open(tiny):
    pipeline = as_webdataset(str(tiny.folder), order=PAIRS)
    keys(pipeline)
    pipeline.close()


@pytest.mark.parametrize("access", list(RemoteAccess))
def test_a_release_behind_a_url_gives_the_same_samples_though_its_store_fails_now_and_then(remote, tmp_path, access):
    order = OrderConfig(seed=1, global_batch=4)
    expected = list(as_webdataset(str(remote.published.folder), split="", order=order))
    read = remote.read(access=access, cache_dir=str(tmp_path / "cache"), verify=Verify.ALWAYS)
    pipeline = as_webdataset(remote.url, split="", order=order, read=read)
    remote.proxy.spoil(r"\.tar", Fault.RESET_IN_BODY, times=1)
    remote.proxy.spoil(r"\.tar", Fault.WRONG_BYTES, times=1)
    samples = list(pipeline)
    pipeline.close()
    assert remote.proxy.spoiled() == 2
    assert len(samples) == 24
    for sample, local in zip(samples, expected, strict=True):
        places = {"__url__", "__local_path__"}
        assert {name: sample[name] for name in sample if name not in places} == {
            name: local[name] for name in local if name not in places
        }
        assert sample["__url__"].startswith(remote.url)
        assert "__local_path__" not in sample
