"""What runs on a GPU: flex_attention with a block mask made from the table."""

from collections.abc import Callable
from functools import cache
from typing import cast

import torch
from torch import Tensor
from torch.nn.attention.flex_attention import BlockMask, create_block_mask, flex_attention

from wsm_data.schema.sequence import FrameTable
from wsm_model.config import ModelConfig
from wsm_model.mot.attention import Attended, JointTokens, flatten_tokens, unflatten_tokens
from wsm_model.mot.mask import allowed, rule_matrix, token_table

_LENGTHS = 256


def block_mask(config: ModelConfig, table: FrameTable, device: torch.device) -> BlockMask:
    """The mask of `dense_mask` in blocks: what is empty as a whole is skipped, what is full needs no test."""
    tokens = token_table(config, table.latent.shape[1])
    kind, frame = tokens.kind.to(device), tokens.frame.to(device)
    rules = rule_matrix(config.variant).to(device)
    of_frames = (table.sequence, table.latent, table.chunk)
    sequence, latent, chunk = (torch.from_numpy(values).to(device) for values in of_frames)

    def may_attend(b: Tensor, _head: Tensor, query: Tensor, key: Tensor) -> Tensor:
        q_frame, k_frame = frame[query], frame[key]
        seen = allowed(
            rules[kind[query], kind[key]],
            latent=(latent[b, q_frame], latent[b, k_frame]),
            chunk=(chunk[b, q_frame], chunk[b, k_frame]),
        )
        own = sequence[b, q_frame]
        return (seen & (own == sequence[b, k_frame]) & (own >= 0)) | ((own < 0) & (query == key))

    length = len(kind)
    return create_block_mask(may_attend, len(sequence), None, length, length, device=device)


def attend_flexibly(tokens: JointTokens, mask: BlockMask) -> Attended:
    """Joint attention under a block mask; compiled on a GPU, interpreted elsewhere."""
    queries, keys, values = (flatten_tokens([part[i] for part in tokens.values()]) for i in range(3))
    attend = compiled() if queries.is_cuda else cast(Callable[..., Tensor], flex_attention)
    return unflatten_tokens(attend(queries, keys, values, block_mask=mask), tokens)


@cache
def compiled(backend: str = "inductor") -> Callable[..., Tensor]:
    """flex_attention, compiled once for each number and length of rows.

    Beyond its limit of recompilations (8), torch would fall back without a word to a form that stores all L x L scores.
    The limit is raised to the lengths a run may have, and beyond that it is an error.
    """
    torch._dynamo.config.recompile_limit = max(_LENGTHS, torch._dynamo.config.recompile_limit)
    return torch.compile(flex_attention, dynamic=False, fullgraph=True, backend=backend)
