"""What runs on a CPU: the mask's blocks one by one, without a mask.

Along the chunks of one sequence every row of the table is a plain attention over stretches of earlier tokens: clean
tokens of latent i over clean tokens up to i, noisy tokens of a chunk over all clean tokens before it and over itself,
and so on. Only pairs that see each other are evaluated, and nothing of L x L is stored.
"""

from collections import defaultdict
from collections.abc import Sequence

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_model.config import Expert, Variant
from wsm_model.mot.attention import Attended, JointTokens, QueriesKeysValues
from wsm_model.mot.chunks import SequenceSpan, chunk_bounds

CLEAN, PREDICTION = 0, 1


def attend_by_blocks(tokens: JointTokens, spans: Sequence[SequenceSpan], variant: Variant) -> Attended:
    """Joint attention of clean and prediction copies under the mask of `wsm_model.mot.mask`.

    Args:
        tokens: of every expert, G = 2: clean, prediction.
        spans: the sequences of the batch.
        variant: whose table.

    Returns:
        What each token gathered; zeros for padding.
    """
    rgb = tokens[Expert.GENERATION]
    state = _join([part for expert, part in tokens.items() if expert is not Expert.GENERATION])
    gathered_rgb, gathered_state = torch.zeros_like(rgb.queries), torch.zeros_like(state.queries)
    for (start, length, chunk_size), rows in _alike(spans).items():
        place = slice(start, start + length)
        found = _attend_sequence(_part(rgb, rows, place), _part(state, rows, place), chunk_size, variant)
        if rows == list(range(len(gathered_rgb))) and length == gathered_rgb.shape[2]:
            gathered_rgb, gathered_state = found
        else:
            gathered_rgb = _put(gathered_rgb, found[0], rows, place)
            gathered_state = _put(gathered_state, found[1], rows, place)
    return {Expert.GENERATION: gathered_rgb, **_split(gathered_state, tokens)}


def _alike(spans: Sequence[SequenceSpan]) -> dict[tuple[int, int, int], list[int]]:
    """Rows whose sequences have one place, length and chunk size are attended together."""
    rows = defaultdict(list)
    for span in sorted(spans):
        rows[span.start, span.length, span.chunk_size].append(span.row)
    return dict(rows)


def _attend_sequence(
    rgb: QueriesKeysValues, state: QueriesKeysValues, chunk_size: int, variant: Variant
) -> tuple[Tensor, Tensor]:
    frames = rgb.queries.shape[2]
    clean_rgb = [_over(rgb, CLEAN, slice(i, i + 1), [(rgb, CLEAN, i + 1)]) for i in range(frames)]
    clean_state = [_over(state, CLEAN, slice(i, i + 1), [(state, CLEAN, i + 1)]) for i in range(frames)]
    noisy, queries = [], []
    for first, end in chunk_bounds(frames, chunk_size):
        own = slice(first, end)
        past_state = [(state, CLEAN, first)]
        seen_by_noisy = [(rgb, CLEAN, first), *(past_state if variant is Variant.SLAM else [])]
        noisy.append(_over(rgb, PREDICTION, own, seen_by_noisy))
        queries.append(_over(state, PREDICTION, own, [(rgb, CLEAN, end), *past_state]))
    return (
        torch.stack([torch.cat(clean_rgb, dim=1), torch.cat(noisy, dim=1)], dim=1),
        torch.stack([torch.cat(clean_state, dim=1), torch.cat(queries, dim=1)], dim=1),
    )


def _over(part: QueriesKeysValues, copy: int, frames: slice, seen: list[tuple[QueriesKeysValues, int, int]]) -> Tensor:
    """What one copy of some frames gathers from the first frames of others, and from itself if it is a prediction."""
    stretches = [(other, kind, slice(0, end)) for other, kind, end in seen if end]
    if copy == PREDICTION:
        stretches.append((part, PREDICTION, frames))
    queries = part.queries[:, copy, frames]
    keys = torch.cat([_sequence(other.keys[:, kind, place]) for other, kind, place in stretches], dim=2)
    values = torch.cat([_sequence(other.values[:, kind, place]) for other, kind, place in stretches], dim=2)
    found = scaled_dot_product_attention(_sequence(queries), keys, values)
    return found.transpose(1, 2).reshape(queries.shape)


def _sequence(x_BFPHd: Tensor) -> Tensor:
    """Tokens of some frames as one sequence per head, [B, H, F P, d]."""
    return x_BFPHd.flatten(1, 2).transpose(1, 2)


def _join(parts: list[QueriesKeysValues]) -> QueriesKeysValues:
    """Depth and pose tokens of a frame side by side: they attend, and are attended to, alike."""
    return QueriesKeysValues(*(torch.cat([part[i] for part in parts], dim=3) for i in range(3)))


def _split(state: Tensor, tokens: JointTokens) -> Attended:
    experts = [expert for expert in tokens if expert is not Expert.GENERATION]
    pieces = state.split([tokens[expert].queries.shape[3] for expert in experts], dim=3)
    return dict(zip(experts, pieces, strict=True))


def _part(part: QueriesKeysValues, rows: list[int], place: slice) -> QueriesKeysValues:
    everything = rows == list(range(len(part.queries)))
    return QueriesKeysValues(*((x if everything else x[rows])[:, :, place] for x in part))


def _put(whole: Tensor, found: Tensor, rows: list[int], place: slice) -> Tensor:
    filled = whole.clone()
    filled[rows, :, place] = found
    return filled
