"""What runs on a CPU: the parts of the mask that hold anything, a few frames of queries at a time.

Queries of some consecutive frames see, of each kind of key, one stretch of frames: from the table follows where it
ends. So a block of queries is one attention over the stretches that its kind may see, with the table's own cells as a
mask inside. What lies beyond is never evaluated, and nothing of L x L is stored. Sequences of one length share their
blocks, whatever their chunk sizes. The blocks are planned once for all layers.

Shape suffixes: B rows, F latent frames, P tokens of a frame, H heads, d width of a head.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_data.schema.sequence import SequenceSpan, chunk_numbers
from wsm_model.config import Expert, ModelConfig
from wsm_model.mot.attention import Attended, JointTokens, QueriesKeysValues
from wsm_model.mot.mask import RULES, Rule, TokenKind, allowed

CLEAN, PREDICTION = 0, 1
_BLOCK_TOKENS = 256
"""Queries of a block, about: enough for matrix products to pay, few enough that little is evaluated for nothing."""

_RGB_KINDS = (TokenKind.CLEAN_RGB, TokenKind.NOISY_RGB)
_COPY = {
    TokenKind.CLEAN_RGB: CLEAN,
    TokenKind.CLEAN_STATE: CLEAN,
    TokenKind.NOISY_RGB: PREDICTION,
    TokenKind.STATE_QUERY: PREDICTION,
}


@dataclass(frozen=True, kw_only=True)
class QueryBlock:
    """Queries of one kind in consecutive frames, and all that they see.

    Attributes:
        kind: of the queries.
        frames: their frames, from the start of the sequence.
        seen: kinds of keys with the frames of each that any of the queries sees.
        mask: which tokens see which, bool [b, 1, queries, keys]; b is 1 where all sequences agree, and it is None where
            all see all.
    """

    kind: TokenKind
    frames: slice
    seen: tuple[tuple[TokenKind, slice], ...]
    mask: Tensor | None


@dataclass(frozen=True, kw_only=True)
class SequenceGroup:
    """Sequences that stand at the same place in their rows, and have one length.

    Attributes:
        rows: their rows.
        place: their frames in the row.
        blocks: what is evaluated.
    """

    rows: tuple[int, ...]
    place: slice
    blocks: tuple[QueryBlock, ...]


def plan_blocks(config: ModelConfig, spans: Sequence[SequenceSpan], device: torch.device) -> tuple[SequenceGroup, ...]:
    """The blocks of a batch, the same in every layer."""
    alike: dict[tuple[int, int], list[SequenceSpan]] = defaultdict(list)
    for span in sorted(spans):
        alike[span.start, span.length].append(span)
    return tuple(
        SequenceGroup(
            rows=tuple(span.row for span in group),
            place=slice(start, start + length),
            blocks=_blocks(config, length, [span.chunk_size for span in group], device),
        )
        for (start, length), group in alike.items()
    )


def attend_by_blocks(tokens: JointTokens, plan: Sequence[SequenceGroup]) -> Attended:
    """Joint attention of clean and prediction copies under the mask of `wsm_model.mot.mask`.

    Args:
        tokens: of every expert, [B, G, F, P, H, d] with G = 2: clean, prediction.
        plan: of `plan_blocks`.

    Returns:
        What each token gathered; zeros for padding.
    """
    parts = (
        tokens[Expert.GENERATION],
        _join([part for expert, part in tokens.items() if expert is not Expert.GENERATION]),
    )
    whole = [torch.zeros_like(part.queries) for part in parts]
    for group in plan:
        covers_all = group.rows == tuple(range(len(whole[0]))) and group.place == slice(0, whole[0].shape[2])
        found = _attend_group([_part(part, group) for part in parts], group)
        whole = found if covers_all else [_put(old, new, group) for old, new in zip(whole, found, strict=True)]
    return {Expert.GENERATION: whole[0], **_split(whole[1], tokens)}


def _blocks(config: ModelConfig, length: int, chunk_sizes: list[int], device: torch.device) -> tuple[QueryBlock, ...]:
    latent = torch.arange(length)
    chunk = torch.stack([torch.from_numpy(chunk_numbers(latent.numpy(), size)) for size in chunk_sizes])
    chunk = chunk[:1] if len(set(chunk_sizes)) == 1 else chunk
    found = []
    for kind in TokenKind:
        frames_a_block = max(1, _BLOCK_TOKENS // _tokens(config, kind))
        for first in range(0, length, frames_a_block):
            found.append(_block(config, kind, slice(first, min(length, first + frames_a_block)), latent, chunk, device))
    return tuple(found)


def _block(
    config: ModelConfig, kind: TokenKind, frames: slice, latent: Tensor, chunk: Tensor, device: torch.device
) -> QueryBlock:
    """One block; the frames of a kind of keys are those between the first and the last that any query sees."""
    seen, masks = [], []
    for key_kind in TokenKind:
        rule = RULES[config.variant].get((kind, key_kind), Rule.NEVER)
        visible = allowed(
            torch.tensor(int(rule)),
            latent=(latent[frames, None], latent[None, :]),
            chunk=(chunk[:, frames, None], chunk[:, None, :]),
        ).expand(len(chunk), -1, -1)
        columns = visible.any(dim=(0, 1)).nonzero().flatten().tolist()
        if columns:
            place = slice(columns[0], columns[-1] + 1)
            seen.append((key_kind, place))
            masks.append(visible[:, :, place].repeat_interleave(_tokens(config, key_kind), dim=2))
    mask = torch.cat(masks, dim=2).repeat_interleave(_tokens(config, kind), dim=1)[:, None]
    return QueryBlock(kind=kind, frames=frames, seen=tuple(seen), mask=None if mask.all() else mask.to(device))


def _tokens(config: ModelConfig, kind: TokenKind) -> int:
    """Tokens of a frame of this kind."""
    if kind in _RGB_KINDS:
        return config.tokens[Expert.GENERATION]
    return sum(config.tokens[expert] for expert in config.state_experts)


def _attend_group(parts: Sequence[QueriesKeysValues], group: SequenceGroup) -> list[Tensor]:
    """What RGB and state tokens of some sequences gather, [b, 2, F, P, H, d] each."""
    gathered: dict[TokenKind, list[Tensor]] = {kind: [] for kind in TokenKind}
    for block in group.blocks:
        own = parts[block.kind not in _RGB_KINDS]
        queries = own.queries[:, _COPY[block.kind], block.frames]
        keys, values = (
            torch.cat([_of_kind(parts, name, kind)[:, place].flatten(1, 2) for kind, place in block.seen], dim=1)
            for name in ("keys", "values")
        )
        found = scaled_dot_product_attention(
            queries.flatten(1, 2).transpose(1, 2), keys.transpose(1, 2), values.transpose(1, 2), attn_mask=block.mask
        )
        gathered[block.kind].append(found.transpose(1, 2).reshape(queries.shape))
    whole = {kind: torch.cat(pieces, dim=1) for kind, pieces in gathered.items()}
    return [
        torch.stack([whole[TokenKind.CLEAN_RGB], whole[TokenKind.NOISY_RGB]], dim=1),
        torch.stack([whole[TokenKind.CLEAN_STATE], whole[TokenKind.STATE_QUERY]], dim=1),
    ]


def _of_kind(parts: Sequence[QueriesKeysValues], name: str, kind: TokenKind) -> Tensor:
    """Keys or values of all frames of a kind, [b, F, P, H, d]."""
    tensor: Tensor = getattr(parts[kind not in _RGB_KINDS], name)
    return tensor[:, _COPY[kind]]


def _join(parts: list[QueriesKeysValues]) -> QueriesKeysValues:
    """Depth and pose tokens of a frame side by side: they attend, and are attended to, alike."""
    return QueriesKeysValues(*(torch.cat([part[i] for part in parts], dim=3) for i in range(3)))


def _split(state: Tensor, tokens: JointTokens) -> Attended:
    experts = [expert for expert in tokens if expert is not Expert.GENERATION]
    pieces = state.split([tokens[expert].queries.shape[3] for expert in experts], dim=3)
    return dict(zip(experts, pieces, strict=True))


def _part(part: QueriesKeysValues, group: SequenceGroup) -> QueriesKeysValues:
    everything = group.rows == tuple(range(len(part.queries)))
    return QueriesKeysValues(*((x if everything else x[list(group.rows)])[:, :, group.place] for x in part))


def _put(whole: Tensor, found: Tensor, group: SequenceGroup) -> Tensor:
    filled = whole.clone()
    filled[list(group.rows), :, group.place] = found
    return filled
