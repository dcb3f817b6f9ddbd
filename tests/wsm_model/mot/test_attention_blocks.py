"""The blocks that run: what they cover, and what they leave out."""

import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan, frame_table
from wsm_model.mot.attention_blocks import plan_blocks
from wsm_model.mot.mask import TokenKind, dense_mask

CPU = torch.device("cpu")


def pairs_evaluated(config, plan) -> int:
    """Pairs of tokens that all blocks of one sequence evaluate."""
    tokens = {
        TokenKind.CLEAN_RGB: config.patches,
        TokenKind.NOISY_RGB: config.patches,
        TokenKind.CLEAN_STATE: config.patches + config.pose_slots,
        TokenKind.STATE_QUERY: config.patches + config.pose_slots,
    }
    total = 0
    for block in plan[0].blocks:
        queries = (block.frames.stop - block.frames.start) * tokens[block.kind]
        total += queries * sum((place.stop - place.start) * tokens[kind] for kind, place in block.seen)
    return total


@pytest.mark.parametrize("chunk_size", [1, 2, 3, 4])
def test_at_64_latents_less_than_a_third_of_the_dense_matrix_is_evaluated_and_all_that_is_seen(config, chunk_size):
    span = SequenceSpan(row=0, start=0, length=64, chunk_size=chunk_size)
    mask = dense_mask(config, frame_table([span], 1, 64))
    evaluated = pairs_evaluated(config, plan_blocks(config, [span], CPU))
    assert int(mask.sum()) <= evaluated < mask.numel() / 3


def test_sequences_of_one_length_share_blocks_whatever_their_chunk_sizes(config):
    spans = [SequenceSpan(row=row, start=0, length=9, chunk_size=1 + row % 4) for row in range(8)]
    (group,) = plan_blocks(config, spans, CPU)
    assert group.rows == tuple(range(8))
    masks = [block.mask for block in group.blocks if block.mask is not None]
    assert {mask.shape[0] for mask in masks} == {8}
    (alone,) = plan_blocks(config, spans[:1], CPU)
    assert {block.mask.shape[0] for block in alone.blocks if block.mask is not None} == {1}
