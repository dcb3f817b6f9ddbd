"""What runs on a GPU: flex_attention with a block mask made from the table."""

from collections.abc import Callable
from functools import cache
from typing import cast

import torch
from torch import Tensor
from torch.nn.attention.flex_attention import BlockMask, flex_attention

from wsm_data.schema.arrays import Int64Array
from wsm_data.schema.sequence import NO_SEQUENCE, FrameTable
from wsm_model.config import ModelConfig
from wsm_model.mot.attention import Attended, JointTokens, flatten_tokens, unflatten_tokens
from wsm_model.mot.mask import TokenTable, allowed, rule_matrix, token_table

_LENGTHS = 256
_BLOCK = 128
"""Queries, and keys, of a block of the mask; flex_attention's own choice."""
_LENGTH_STEP = 2048
"""Rows are filled up to a multiple of so many tokens: kernels are compiled for a few lengths, not for each."""


def block_mask(config: ModelConfig, table: FrameTable, device: torch.device) -> BlockMask:
    """The mask of `dense_mask` in blocks: what is empty as a whole is skipped, what is full needs no test.

    Tokens of a frame and kind see, and are seen, alike. So blocks are judged by the frames that they reach over, and
    nothing of tokens by tokens is stored: with 200 latents of a row 1201 x 1201 cells for 49,600 x 49,600 pairs.
    """
    tokens = _filled_up(token_table(config, table.latent.shape[1]))
    frame = tokens.frame.to(device)
    columns = (_with_filling(values, frame, device) for values in (table.sequence, table.latent, table.chunk))
    sequence, latent, chunk = columns
    kind, rules = tokens.kind.to(device), rule_matrix(config.variant).to(device)

    def may_attend(b: Tensor, _head: Tensor, query: Tensor, key: Tensor) -> Tensor:
        seen = allowed(
            rules[kind[query], kind[key]],
            latent=(latent[b, query], latent[b, key]),
            chunk=(chunk[b, query], chunk[b, key]),
        )
        own = sequence[b, query]
        return (seen & (own == sequence[b, key]) & (own >= 0)) | ((own < 0) & (query == key))

    first, cell = _cells(kind, frame)
    row = torch.arange(len(sequence), device=device)[:, None, None]
    visible = may_attend(row, row, first[:, None], first) & (sequence[:, first] >= 0)[:, :, None]
    some, every = _blocks(visible, cell)
    filling = (sequence < 0).unflatten(1, (-1, _BLOCK)).any(2)
    some = some | torch.diag_embed(filling)
    partial_list, full_list = _listed(some & ~every), _listed(every)
    length = len(kind)
    return BlockMask.from_kv_blocks(
        *partial_list, *full_list, BLOCK_SIZE=_BLOCK, mask_mod=may_attend, seq_lengths=(length, length)
    )


def attend_flexibly(tokens: JointTokens, mask: BlockMask) -> Attended:
    """Joint attention under a block mask; compiled on a GPU, interpreted elsewhere."""
    length = mask.seq_lengths[0]
    queries, keys, values = (_flattened([part[i] for part in tokens.values()], length) for i in range(3))
    attend = compiled() if queries.is_cuda else cast(Callable[..., Tensor], flex_attention)
    found = attend(queries, keys, values, block_mask=mask)
    own = sum(part.queries.shape[1:4].numel() for part in tokens.values())
    return unflatten_tokens(found[:, :, :own], tokens)


def _filled_up(tokens: TokenTable) -> TokenTable:
    """The table with tokens of a frame behind the last, which is none of any sequence, up to the next length."""
    more = -len(tokens.kind) % _LENGTH_STEP
    behind = int(tokens.frame.max()) + 1
    return TokenTable(
        kind=torch.cat([tokens.kind, torch.zeros(more, dtype=torch.int64)]),
        frame=torch.cat([tokens.frame, torch.full((more,), behind)]),
    )


def _with_filling(values: Int64Array, frame: Tensor, device: torch.device) -> Tensor:
    """What stands of each frame, [B, F], for each token, [B, L]; that of no sequence for the frame behind the last."""
    none = torch.full((len(values), 1), NO_SEQUENCE)
    return torch.cat([torch.from_numpy(values), none], dim=1).to(device)[:, frame]


def _cells(kind: Tensor, frame: Tensor) -> tuple[Tensor, Tensor]:
    """Runs of tokens of one kind and frame: the first token of each run, [N], and the run of each token, [L]."""
    begins = torch.ones_like(kind, dtype=torch.bool)
    begins[1:] = (kind[1:] != kind[:-1]) | (frame[1:] != frame[:-1])
    return begins.nonzero().flatten(), begins.cumsum(0) - 1


def _blocks(visible: Tensor, cell: Tensor) -> tuple[Tensor, Tensor]:
    """Whether some, and whether every, pair of cells within a block is visible; bool [B, blocks, blocks] each."""
    ends = cell.unflatten(0, (-1, _BLOCK))
    low, high = ends[:, 0], ends[:, -1] + 1
    sums = torch.nn.functional.pad(visible.int().cumsum(1).cumsum(2), (1, 0, 1, 0))
    count = (
        sums[:, high[:, None], high]
        - sums[:, low[:, None], high]
        - sums[:, high[:, None], low]
        + sums[:, low[:, None], low]
    )
    reach = high - low
    return count > 0, count == reach[:, None] * reach


def _listed(blocks: Tensor) -> tuple[Tensor, Tensor]:
    """How many blocks of keys each block of queries has, [B, 1, blocks], and which, first; int32."""
    order = torch.argsort(blocks.int(), dim=-1, descending=True, stable=True)
    return blocks.sum(-1, dtype=torch.int32)[:, None], order.int()[:, None]


def _flattened(parts: list[Tensor], length: int) -> Tensor:
    """`flatten_tokens`, filled up with zeros in the same copy."""
    first = parts[0]
    own = sum(part.shape[1:4].numel() for part in parts)
    filling = first.new_zeros(len(first), 1, 1, length - own, *first.shape[4:])
    return flatten_tokens([*parts, filling])


@cache
def compiled(backend: str = "inductor") -> Callable[..., Tensor]:
    """flex_attention, compiled once for each number and filled-up length of rows.

    Beyond its limit of recompilations (8), torch would fall back without a word to a form that stores all L x L scores.
    The limit is raised to the lengths a run may have, and beyond that it is an error.
    """
    torch._dynamo.config.recompile_limit = max(_LENGTHS, torch._dynamo.config.recompile_limit)
    return torch.compile(flex_attention, dynamic=False, fullgraph=True, backend=backend)
