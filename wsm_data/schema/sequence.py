"""Frames, latents, chunks, and where sequences stand in the rows of a batch.

A clip of T = 1 + 4k raw frames has F = 1 + k latents: latent 0 is raw frame 0, latent j >= 1 covers the raw frames
4j - 3 to 4j. Latent 0 is a chunk of its own, the clean anchor; later chunks hold K latents and the last one may be
shorter (paper silent on both).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.schema.arrays import Int64Array

TEMPORAL_RATIO = 4
"""Raw frames of a latent after the first."""

POSE_SLOTS = TEMPORAL_RATIO
"""Pose slots of a latent: latent j >= 1 has those of its raw frames 4j - 3 to 4j, latent 0 the identity in each."""

NO_SEQUENCE = -1
"""What stands for a sequence where there is none."""


def frames_of(latents: int) -> int:
    """Raw frames of a clip of `latents` latents."""
    return 1 + TEMPORAL_RATIO * (latents - 1)


def latent_of(frame: int) -> int:
    """Latent that a raw frame lies in: frame 0 in latent 0, frames 4j - 3 to 4j in latent j."""
    return -(-frame // TEMPORAL_RATIO)


def chunk_bounds(length: int, chunk_size: int) -> list[tuple[int, int]]:
    """First latent and end of every chunk: [(0, 1), (1, 1 + K), ...]."""
    starts = [0, *range(1, length, chunk_size)]
    return list(zip(starts, [*starts[1:], length], strict=True))


def chunk_start(latent: int, chunk_size: int) -> int:
    """First latent of the chunk that a latent belongs to."""
    return 1 + (latent - 1) // chunk_size * chunk_size if latent else 0


def chunk_numbers(latent: Int64Array, chunk_size: Int64Array | int) -> Int64Array:
    """Chunk of each latent j of its sequence: 0 for latent 0, 1 + (j - 1) // K after it."""
    numbers: Int64Array = 1 + (latent - 1) // chunk_size  # -1 // K is -1
    return numbers


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
        if self.length < 1 or self.chunk_size < 1 or self.row < 0 or self.start < 0:
            raise ValueError(f"a sequence needs a place, a length and a chunk size of at least 1, found {self}")

    @property
    def end(self) -> int:
        """First latent of the row behind the sequence."""
        return self.start + self.length

    @property
    def place(self) -> tuple[int, slice]:
        """What picks the sequence out of an array [rows, latents, ...]."""
        return self.row, slice(self.start, self.end)


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameTable:
    """For every latent of a batch: which sequence, latent and chunk it is. All int64 [B, F].

    Attributes:
        sequence: number of the sequence in the batch; -1 for padding.
        latent: number of the latent in its sequence; 0 for padding.
        chunk: number of its chunk; 0 for padding.
    """

    sequence: Int64Array
    latent: Int64Array
    chunk: Int64Array


def frame_table(spans: Sequence[SequenceSpan], rows: int, latents: int) -> FrameTable:
    """Lay the sequences out in `rows` rows of `latents` latents.

    Raises:
        ValueError: a sequence does not fit its row, or two overlap.
    """
    fields = [(span.row, span.start, span.length, span.chunk_size) for span in spans]
    row, start, length, chunk_size = np.array(fields, np.int64).reshape(-1, 4).T
    misfits = np.flatnonzero((row >= rows) | (start + length > latents))
    if len(misfits):
        raise _without_place(spans, misfits[0], rows, latents)
    number = np.repeat(np.arange(len(spans)), length)
    within = np.arange(len(number)) - np.repeat(np.cumsum(length) - length, length)
    places = (row * latents + start)[number] + within
    sequence = np.full(rows * latents, NO_SEQUENCE)
    latent, chunk = np.zeros((2, rows * latents), np.int64)
    sequence[places], latent[places], chunk[places] = number, within, chunk_numbers(within, chunk_size[number])
    covered = np.flatnonzero(sequence[places] != number)
    if len(covered):
        raise _without_place(spans, number[covered[0]], rows, latents)
    shape = (rows, latents)
    return FrameTable(sequence=sequence.reshape(shape), latent=latent.reshape(shape), chunk=chunk.reshape(shape))


def _without_place(spans: Sequence[SequenceSpan], number: int, rows: int, latents: int) -> ValueError:
    return ValueError(
        f"sequence {number}, {spans[number]}, must have a place of its own in {rows} rows of {latents} latents"
    )
