"""From a loader's batch to noised parts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.batches import ContextNoise, chunk_flow_times, noise_stream, training_inputs

SHIFT = 5.0


@pytest.fixture
def batch(make_poses):
    """Three rows: one sequence, two that share a row, one short."""
    torch.manual_seed(0)
    return SimpleNamespace(
        rgb=torch.randn(3, 6, 6, 4, 6),
        depth=torch.randn(3, 6, 6, 4, 6),
        poses=make_poses(3, 6, 4),
        spans=(
            SequenceSpan(row=0, start=0, length=6, chunk_size=2),
            SequenceSpan(row=1, start=0, length=4, chunk_size=1),
            SequenceSpan(row=1, start=4, length=2, chunk_size=4),
            SequenceSpan(row=2, start=0, length=3, chunk_size=3),
        ),
        goal_camera0_m=torch.randn(4, 3),
        refs=np.array([5, 9, 2, 7]),
        keys=("a", "b", "c", "d"),
        epoch=1,
        step=4,
    )


def parts_of(batch, **changes):
    return list(training_inputs(batch, **({"seed": 3, "flow_shift": SHIFT} | changes)))


def test_parts_hold_every_sequence_once_with_the_noise_it_has_in_the_whole(batch):
    (whole,) = parts_of(batch)
    parts = parts_of(batch, micro_rows=1)
    assert [part.keys for part in parts] == [("a",), ("b", "c"), ("d",)]
    assert parts[2].inputs.rgb.shape[1] == 3  # cut to its longest row
    for row, part in enumerate(parts):
        length = part.noise.shape[1]
        assert torch.equal(part.noise[0], whole.noise[row, :length])
        assert torch.equal(part.inputs.flow_time[0], whole.inputs.flow_time[row, :length])
        assert torch.equal(part.inputs.noisy_rgb[0], whole.inputs.noisy_rgb[row, :length])


def test_a_sequence_has_its_noise_whichever_row_it_falls_to(batch):
    (first,) = parts_of(batch)
    batch.spans, batch.rgb = tuple(replace(span, row=2 - span.row) for span in batch.spans), batch.rgb.flip(0)
    (moved,) = parts_of(batch)
    assert torch.equal(first.noise[0], moved.noise[2])
    assert torch.equal(first.noise[2, :3], moved.noise[0, :3])


def test_noise_is_another_in_each_step_epoch_seed_and_clip():
    streams = [(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]
    drawn = [float(torch.rand(1, generator=noise_stream(*one))) for one in streams]
    assert len(set(drawn)) == len(streams)
    assert drawn[0] == float(torch.rand(1, generator=noise_stream(0, 0, 0, 0)))


def test_noisy_latents_are_the_latents_and_their_noise_at_their_times(batch):
    (part,) = parts_of(batch)
    tau = part.inputs.flow_time[..., None, None, None]
    torch.testing.assert_close(part.inputs.noisy_rgb, (1 - tau) * part.inputs.rgb + tau * part.noise)


def test_later_chunks_see_the_depth_blurred_by_one_share_a_sequence_and_the_rest_stays_as_it_is(batch):
    (plain,) = parts_of(batch)
    (part,) = parts_of(batch, context=ContextNoise(depth=0.5))
    assert plain.inputs.depth_context is None
    assert torch.equal(part.inputs.depth, batch.depth)
    assert torch.equal(part.noise, plain.noise)
    shares = []
    for span in part.inputs.spans:
        place = (span.row, slice(span.start, span.start + span.length))
        seen, depth = part.inputs.depth_context[place].flatten(), batch.depth[place].flatten()
        shares.append(1 - float(seen @ depth / (depth @ depth)))  # (1 - s) d + s eps, with eps independent of d
    assert all(-0.1 < share < 0.6 for share in shares)
    assert max(shares) - min(shares) > 0.05
    beyond = part.inputs.depth_context[2, 3:]
    assert torch.equal(beyond, batch.depth[2, 3:])  # padding


def test_some_sequences_are_seen_with_noise_in_their_rgb_and_what_is_learned_stays_as_it_is(batch):
    """With a probability of 1 every sequence, with 1/2 one to three of the four by this seed."""
    (plain,) = parts_of(batch)
    assert plain.inputs.rgb_context is None
    changed = []
    for probability in (0.0, 0.5, 1.0):
        (part,) = parts_of(batch, context=ContextNoise(rgb=0.5, rgb_probability=probability))
        assert torch.equal(part.inputs.rgb, batch.rgb)
        assert torch.equal(part.inputs.noisy_rgb, plain.inputs.noisy_rgb)
        seen = part.inputs.rgb_context
        changed.append(sum(not torch.equal(seen[span.place], batch.rgb[span.place]) for span in part.inputs.spans))
        for span in part.inputs.spans:
            given, found = batch.rgb[span.place].flatten(), seen[span.place].flatten()
            assert -0.1 < 1 - float(found @ given / (given @ given)) < 0.6
    assert changed[0] == 0
    assert 1 <= changed[1] <= 3
    assert changed[2] == 4


def test_the_blur_of_a_sequence_does_not_depend_on_its_part(batch):
    (whole,) = parts_of(batch, context=ContextNoise(depth=1.0))
    parts = parts_of(batch, context=ContextNoise(depth=1.0), micro_rows=1)
    for row, part in enumerate(parts):
        length = part.noise.shape[1]
        assert torch.equal(part.inputs.depth_context[0], whole.inputs.depth_context[row, :length])


def test_a_chunk_has_one_flow_time():
    span = SequenceSpan(row=0, start=0, length=8, chunk_size=3)  # chunks: 0 | 1 2 3 | 4 5 6 | 7
    times = chunk_flow_times(span, SHIFT, torch.Generator().manual_seed(0)).tolist()
    assert times[1] == times[2] == times[3]
    assert times[4] == times[5] == times[6]
    assert len(set(times)) == 4
    assert all(0 <= time <= 1 for time in times)


def test_sequences_stand_in_their_part_where_the_batch_says(batch):
    _, part, _ = parts_of(batch, micro_rows=1)
    assert part.inputs.spans == (replace(batch.spans[1], row=0), replace(batch.spans[2], row=0))
