"""Joint self-attention over the tokens of all experts: what it takes and gives, and the dense reference.

Shape suffixes: B batch, G copies of a frame (clean, prediction), F latent frames, P tokens of a frame, H heads, d width
of a head, L all tokens of a row.
"""

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_model.config import Expert


class QueriesKeysValues(NamedTuple):
    """What the tokens of one expert bring to the joint attention; each [B, G, F, P, H, d]."""

    queries: Tensor
    keys: Tensor
    values: Tensor


JointTokens = Mapping[Expert, QueriesKeysValues]
Attended = dict[Expert, Tensor]
"""Per expert, what its tokens gathered: [B, G, F, P, H, d]."""


def flatten_tokens(parts: list[Tensor]) -> Tensor:
    """Tokens of all experts [B, G, F, P, H, d] as one sequence per head, [B, H, L, d]."""
    return torch.cat([part.flatten(1, 3) for part in parts], dim=1).transpose(1, 2)


def unflatten_tokens(x_BHLd: Tensor, tokens: JointTokens) -> Attended:
    """Inverse of `flatten_tokens`."""
    shapes = [part.queries.shape for part in tokens.values()]
    lengths = [shape[1] * shape[2] * shape[3] for shape in shapes]
    parts = x_BHLd.transpose(1, 2).split(lengths, dim=1)
    return {expert: part.view(shape) for expert, part, shape in zip(tokens, parts, shapes, strict=True)}


def attend_densely(tokens: JointTokens, mask_BLL: Tensor) -> Attended:
    """The reference: one softmax over all L x L pairs, with the whole mask in memory."""
    queries, keys, values = (flatten_tokens([part[i] for part in tokens.values()]) for i in range(3))
    mask = mask_BLL.to(queries.device)[:, None]
    return unflatten_tokens(scaled_dot_product_attention(queries, keys, values, attn_mask=mask), tokens)
