import numpy as np
import pytest
import torch

from wsm_data.loaders.batches.batch import BatchBlock
from wsm_data.loaders.batches.filling import MEMBER_OF, batch_layout, describe, sequences_of_rows, slots_of
from wsm_data.loaders.config import Arrangement, OrderConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import chunk_sizes
from wsm_data.loaders.reading.clip_places import clip_places
from wsm_data.loaders.sources.clips import open_sources

LATENT_SHAPE = (48, 6, 10)


@pytest.fixture
def order_of(released):
    sources = open_sources([SourceConfig(release=str(released.folder))])

    def make(**settings):
        return sources, sources.order_epoch(OrderConfig(**({"global_batch": 4} | settings)), 0)

    return make


def _placed(sources, epoch_order, step=0):
    rows = epoch_order.rows(step, 0, 1)
    clips = sequences_of_rows(rows, clip_places(sources, np.concatenate(rows)), epoch_order)
    return rows, clips, batch_layout(clips, len(rows), epoch_order, LATENT_SHAPE, torch.float16)


@pytest.mark.parametrize(
    "settings",
    [{}, {"max_latents": 2}, {"arrangement": Arrangement.JOIN, "row_latents": 8, "global_batch": 2}],
    ids=str,
)
def test_the_clips_of_a_row_lie_one_behind_the_other(order_of, settings):
    sources, epoch_order = order_of(**settings)
    for step in range(epoch_order.steps):
        rows, clips, layout = _placed(sources, epoch_order, step)
        assert [clip.place.key for clip in clips] == sources.keys(np.concatenate(rows))
        ends = dict.fromkeys(range(len(rows)), 0)
        for clip in clips:
            assert clip.span.start == ends[clip.span.row]
            assert clip.span.length == min(clip.place.latents, settings.get("max_latents", 99))
            ends[clip.span.row] += clip.span.length
        assert layout.row_latents == (settings.get("row_latents") or max(ends.values()))
        assert (layout.rows, layout.sequences) == (len(rows), len(clips))


def test_slots_of_different_clips_and_tensors_lie_apart(order_of):
    """What is written through the slots of one clip arrives in its latents of each tensor, and nowhere else."""
    sources, epoch_order = order_of(arrangement=Arrangement.JOIN, row_latents=8, global_batch=2)
    _, clips, layout = _placed(sources, epoch_order)
    assert len(clips) > 2
    block = BatchBlock(
        memory=torch.zeros(layout.size_bytes, dtype=torch.uint8),
        layout=layout,
        spans=(),
        refs=np.arange(0),
        keys=(),
        epoch=0,
        step=0,
    )
    for clip in clips:
        slots = slots_of(block, clip)
        for name, member in MEMBER_OF.items():
            slot = slots[member]
            slot[:] = bytes([1]) * slot.nbytes
            written = block.memory.numpy().sum()
            assert written == slot.nbytes
            values = block.tensors[name]
            own = values[clip.span.place]
            own = own.flatten(0, 1)[3:] if name == "poses" else own
            assert own.contiguous().view(torch.uint8).sum() == written
            slot[:] = bytes(slot.nbytes)


def test_describing_says_all_that_is_not_read_whatever_the_memory_held_before(order_of, expected_batch, released):
    sources, epoch_order = order_of(arrangement=Arrangement.JOIN, row_latents=7, global_batch=2)
    padded = 0
    for step in range(epoch_order.steps):
        rows, clips, layout = _placed(sources, epoch_order, step)
        memory = torch.full((layout.size_bytes,), 255, dtype=torch.uint8)
        keys = tuple(clip.place.key for clip in clips)
        refs, spans = np.concatenate(rows), tuple(clip.span for clip in clips)
        goals = [released.clips[key].poses[-1, :3] for key in keys]
        known = {"spans": spans, "refs": refs, "keys": keys, "epoch": 0, "step": step}
        block = BatchBlock(memory=memory, layout=layout, **known)
        describe(block, clips, goals)
        batch = block.batch()
        expected = expected_batch(batch, released.clips, row_latents=7)
        for name in ("still", "sequence_id", "latent_index", "goal_camera0_m"):
            np.testing.assert_array_equal(getattr(batch, name), expected[name], err_msg=name)
        assert [span.chunk_size for span in spans] == chunk_sizes(refs, epoch_order.config, epoch_order.epoch).tolist()
        padding = batch.sequence_id < 0
        padded += int(padding.sum())
        for values in (batch.rgb, batch.depth, batch.depth_valid, batch.poses):
            assert not values[padding].any()
        for clip in clips:
            assert batch.poses[clip.span.row, clip.span.start, :3].tolist() == [[0, 0, 0, 1, 0, 0, 0]] * 3
    assert padded
