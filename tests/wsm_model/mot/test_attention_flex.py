"""The block mask of flex_attention against the dense mask, pair by pair and block by block."""

import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan, frame_table
from wsm_model.config import Variant
from wsm_model.model import Attention
from wsm_model.mot.attention_flex import block_mask, compiled
from wsm_model.mot.mask import dense_mask

CPU = torch.device("cpu")
FRAMES = 40  # 1280 tokens a row, ten blocks of 128


@pytest.fixture(params=[1, 2, 3, 4])
def table(request):
    """A whole row, two sequences packed into one, and one with padding on both sides."""
    spans = [
        SequenceSpan(row=0, start=0, length=FRAMES, chunk_size=request.param),
        SequenceSpan(row=1, start=0, length=17, chunk_size=request.param),
        SequenceSpan(row=1, start=17, length=20, chunk_size=5 - request.param),
        SequenceSpan(row=2, start=3, length=9, chunk_size=request.param),
    ]
    return frame_table(spans, 3, FRAMES)


@pytest.mark.parametrize("variant", Variant)
def test_every_pair_is_allowed_as_in_the_dense_mask(make_model, table, variant):
    config = make_model(variant).config
    wanted, mask = dense_mask(config, table), block_mask(config, table, CPU)
    places = torch.arange(wanted.shape[1])
    assert mask.seq_lengths == (2048, 2048)
    for row in range(len(wanted)):
        found = mask.mask_mod(torch.tensor(row), torch.tensor(0), places[:, None], places[None, :])
        assert torch.equal(found, wanted[row])


def test_blocks_that_are_skipped_are_empty_and_blocks_that_are_not_tested_are_full(config, table):
    wanted, mask = dense_mask(config, table), block_mask(config, table, CPU)
    size = mask.BLOCK_SIZE[0]
    length = wanted.shape[1] // size * size
    blocks = wanted[:, :length, :length].unflatten(1, (-1, size)).unflatten(3, (-1, size))  # B, rows, _, columns, _
    holds_any, holds_all = blocks.any(4).any(2), blocks.all(4).all(2)
    partial = listed(mask.kv_num_blocks, mask.kv_indices)
    full = listed(mask.full_kv_num_blocks, mask.full_kv_indices)
    count = length // size
    assert torch.equal((partial | full)[:, :count, :count], holds_any)
    assert torch.equal(full[:, :count, :count], holds_all)
    assert not holds_any.all()  # some are skipped


def test_rows_are_filled_up_to_few_lengths_and_what_their_tokens_gather_is_the_same(
    make_model, make_inputs, make_spans
):
    """Rows of 3 to 60 latents of 32 tokens: one length of 2048 tokens."""
    spans = [make_spans([length], [2]) for length in (3, 60)]
    lengths = [block_mask(make_model().config, frame_table(one, 1, one[0].length), CPU).seq_lengths for one in spans]
    assert lengths == [(2048, 2048)] * 2
    inputs = make_inputs(make_spans([3, 2], [2, 1]))
    with torch.no_grad():  # on a processor flex_attention has no backward pass
        found, wanted = (make_model(attention=kind)(inputs) for kind in (Attention.FLEX, Attention.DENSE))
    torch.testing.assert_close(found.velocity, wanted.velocity, rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(found.poses[0], wanted.poses[0], rtol=1e-4, atol=1e-4)


def test_more_lengths_than_torch_would_compile_by_itself_stay_compiled(config, monkeypatch):
    """Beyond its limit, torch's own fall-back would store all scores of all pairs."""
    monkeypatch.setattr("wsm_model.mot.attention_flex._LENGTH_STEP", 128)
    attend = compiled(backend="eager")
    for frames in range(1, 41, 4):
        mask = block_mask(
            config, frame_table([SequenceSpan(row=0, start=0, length=frames, chunk_size=2)], 1, frames), CPU
        )
        tokens = torch.randn(1, 1, mask.seq_lengths[0], 16)
        assert attend(tokens, tokens, tokens, block_mask=mask).shape == tokens.shape


def listed(counts: torch.Tensor, indices: torch.Tensor) -> torch.Tensor:
    """Which key blocks each query block lists: bool [B, query blocks, key blocks]; the lists are padded."""
    counts, indices = counts[:, 0], indices[:, 0]
    found = torch.zeros(indices.shape, dtype=torch.bool)
    for row in range(counts.shape[0]):
        for query in range(counts.shape[1]):
            found[row, query, indices[row, query, : counts[row, query]].long()] = True
    return found
