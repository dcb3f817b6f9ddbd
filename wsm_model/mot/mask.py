r"""The attention mask of training (paper, figure 3b) as a table, and as the matrix it means.

Rows are queries, columns keys; n, m are chunk numbers and i, j latent numbers; "state" is depth and pose together.

| query \ key     | clean RGB (j, m) | clean state (j, m) | noisy RGB (m) | state query (m) |
|-----------------|------------------|--------------------|---------------|-----------------|
| clean RGB (i)   | j <= i           | no                 | no            | no              |
| clean state (i) | no               | j <= i             | no            | no              |
| noisy RGB (n)   | m < n            | m < n              | m = n         | no              |
| state query (n) | m <= n           | m < n              | no            | m = n           |

Keys and values of clean tokens do not depend on the chunk size: a cache of them stays valid at any replanning point.
Without SLAM there are no estimated states, only poses issued before, which noisy RGB tokens do not see (paper, section
4.4, "SLAM IDM").
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType

import torch
from torch import Tensor

from wsm_data.schema.sequence import FrameTable
from wsm_model.config import Expert, ModelConfig, Variant


class TokenKind(IntEnum):
    """The four groups of tokens of a frame."""

    CLEAN_RGB = 0
    CLEAN_STATE = 1
    NOISY_RGB = 2
    STATE_QUERY = 3


class Rule(IntEnum):
    """When a query may attend to a key of the same sequence."""

    NEVER = 0
    UP_TO_OWN_LATENT = 1
    EARLIER_CHUNKS = 2
    UP_TO_OWN_CHUNK = 3
    OWN_CHUNK = 4


_SLAM: Mapping[tuple[TokenKind, TokenKind], Rule] = MappingProxyType(
    {
        (TokenKind.CLEAN_RGB, TokenKind.CLEAN_RGB): Rule.UP_TO_OWN_LATENT,
        (TokenKind.CLEAN_STATE, TokenKind.CLEAN_STATE): Rule.UP_TO_OWN_LATENT,
        (TokenKind.NOISY_RGB, TokenKind.CLEAN_RGB): Rule.EARLIER_CHUNKS,
        (TokenKind.NOISY_RGB, TokenKind.CLEAN_STATE): Rule.EARLIER_CHUNKS,
        (TokenKind.NOISY_RGB, TokenKind.NOISY_RGB): Rule.OWN_CHUNK,
        (TokenKind.STATE_QUERY, TokenKind.CLEAN_RGB): Rule.UP_TO_OWN_CHUNK,
        (TokenKind.STATE_QUERY, TokenKind.CLEAN_STATE): Rule.EARLIER_CHUNKS,
        (TokenKind.STATE_QUERY, TokenKind.STATE_QUERY): Rule.OWN_CHUNK,
    }
)
RULES: Mapping[Variant, Mapping[tuple[TokenKind, TokenKind], Rule]] = MappingProxyType(
    {
        Variant.SLAM: _SLAM,
        Variant.IDM: MappingProxyType(
            {pair: rule for pair, rule in _SLAM.items() if pair != (TokenKind.NOISY_RGB, TokenKind.CLEAN_STATE)}
        ),
    }
)
"""(query, key) to rule; what is not named is `NEVER`."""


@dataclass(frozen=True, kw_only=True)
class TokenTable:
    """Every token of a batch, in the order of `flatten_tokens`.

    Attributes:
        kind: `TokenKind`, int64 [L].
        frame: latent frame in the row, int64 [L].
    """

    kind: Tensor
    frame: Tensor


def token_table(config: ModelConfig, frames: int) -> TokenTable:
    """Tokens of rows of `frames` latents: per expert, the clean copies of all frames, then the prediction copies."""
    kinds, places = [], []
    for expert in config.experts:
        clean, prediction = (
            (TokenKind.CLEAN_RGB, TokenKind.NOISY_RGB)
            if expert is Expert.GENERATION
            else (TokenKind.CLEAN_STATE, TokenKind.STATE_QUERY)
        )
        for kind in (clean, prediction):
            kinds.append(torch.full((frames * config.tokens[expert],), int(kind)))
            places.append(torch.arange(frames).repeat_interleave(config.tokens[expert]))
    return TokenTable(kind=torch.cat(kinds), frame=torch.cat(places))


def rule_matrix(variant: Variant) -> Tensor:
    """The table as int64 [query kind, key kind]."""
    matrix = torch.zeros(len(TokenKind), len(TokenKind), dtype=torch.int64)
    for (query, key), rule in RULES[variant].items():
        matrix[query, key] = int(rule)
    return matrix


def allowed(rule: Tensor, *, latent: tuple[Tensor, Tensor], chunk: tuple[Tensor, Tensor]) -> Tensor:
    """Whether a rule lets a query see a key, elementwise; pairs are (of the query, of the key).

    Rules are compared as plain integers: the compiler behind flex_attention takes a comparison with an enumeration's
    member for false, without a word.
    """
    (i, j), (n, m) = latent, chunk
    return (
        ((rule == int(Rule.UP_TO_OWN_LATENT)) & (j <= i))
        | ((rule == int(Rule.EARLIER_CHUNKS)) & (m < n))
        | ((rule == int(Rule.UP_TO_OWN_CHUNK)) & (m <= n))
        | ((rule == int(Rule.OWN_CHUNK)) & (m == n))
    )


def dense_mask(config: ModelConfig, table: FrameTable) -> Tensor:
    """The whole matrix: bool [B, L, L], true where the row may attend to the column.

    Tokens of padding frames attend to themselves alone, so that no row is empty.
    """
    tokens = token_table(config, table.latent.shape[1])
    rule = rule_matrix(config.variant)[tokens.kind[:, None], tokens.kind[None, :]]
    of_frames = (torch.from_numpy(values) for values in (table.sequence, table.latent, table.chunk))
    sequence, latent, chunk = (values[:, tokens.frame] for values in of_frames)
    same = (sequence[:, :, None] == sequence[:, None, :]) & (sequence >= 0)[:, :, None]
    seen = allowed(
        rule,
        latent=(latent[:, :, None], latent[:, None, :]),
        chunk=(chunk[:, :, None], chunk[:, None, :]),
    )
    padding = torch.diag_embed(sequence < 0)
    return (seen & same) | padding
