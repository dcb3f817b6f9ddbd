"""Sequences in the rows of a batch, and the chunks they are cut into.

Latent 0 of a sequence is a chunk of its own, the clean anchor; later chunks hold K latents and the last one may be
shorter (paper silent on both).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, kw_only=True, order=True)
class SequenceSpan:
    """Where a sequence stands in a batch.

    Attributes:
        row: row of the batch.
        start: first latent in the row.
        length: number of latents.
        chunk_size: K.
    """

    row: int
    start: int
    length: int
    chunk_size: int

    def __post_init__(self) -> None:
        if min(self.length, self.chunk_size) < 1 or min(self.row, self.start) < 0:
            raise ValueError(f"a sequence needs a place, a length and a chunk size of at least 1, found {self}")


def chunk_bounds(length: int, chunk_size: int) -> list[tuple[int, int]]:
    """First latent and end of every chunk: [(0, 1), (1, 1 + K), ...]."""
    starts = [0, *range(1, length, chunk_size)]
    return list(zip(starts, [*starts[1:], length], strict=True))


def chunk_numbers(latent_index: Tensor, chunk_size: Tensor) -> Tensor:
    """Chunk of each latent: 0 for latent 0, 1 + (j - 1) // K after it; negative numbers of padding stay negative."""
    later = 1 + torch.div(latent_index - 1, chunk_size, rounding_mode="floor")
    return torch.where(latent_index > 0, later, latent_index.clamp(max=0))


@dataclass(frozen=True, kw_only=True)
class FrameTable:
    """For every latent frame of a batch: which sequence, latent and chunk it is. All int64 [B, F].

    Attributes:
        sequence: number of the sequence in the batch; -1 for padding.
        latent: number of the latent in its sequence; 0 for padding.
        chunk: number of its chunk; 0 for padding.
    """

    sequence: Tensor
    latent: Tensor
    chunk: Tensor


def frame_table(spans: Sequence[SequenceSpan], rows: int, frames: int) -> FrameTable:
    """Lay the sequences out in `rows` rows of `frames` latents.

    Raises:
        ValueError: a sequence does not fit its row, or two overlap.
    """
    sequence = torch.full((rows, frames), -1)
    latent, chunk = torch.zeros(rows, frames, dtype=torch.int64), torch.zeros(rows, frames, dtype=torch.int64)
    for number, span in enumerate(spans):
        place = slice(span.start, span.start + span.length)
        if span.row >= rows or place.stop > frames or (sequence[span.row, place] >= 0).any():
            raise ValueError(
                f"sequence {number}, {span}, must have a place of its own in {rows} rows of {frames} latents"
            )
        sequence[span.row, place] = number
        latent[span.row, place] = torch.arange(span.length)
        chunk[span.row, place] = chunk_numbers(torch.arange(span.length), torch.tensor(span.chunk_size))
    return FrameTable(sequence=sequence, latent=latent, chunk=chunk)
