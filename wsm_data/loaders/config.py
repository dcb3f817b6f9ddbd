"""Settings of a loader: what is read, in which order, how it becomes batches, and how it is read.

Order and batches decide what a training run sees, so they are part of the state that a checkpoint keeps. How the bytes
are read (threads, caches) never changes what is delivered.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from wsm_data.access.config import AccessConfig
from wsm_data.schema.latent_standard import LatentStandard

MAX_CHUNK_LATENTS = 4
"""Largest chunk size K (paper, implementation details: K is drawn from 1 to 4)."""


class Remainder(StrEnum):
    """What becomes of the rows that do not fill the last global step of an epoch."""

    DROP = "drop"
    REPEAT = "repeat"
    PAD = "pad"


class Arrangement(StrEnum):
    """How clips of different lengths share a batch."""

    PLAIN = "plain"
    BUCKET = "bucket"
    JOIN = "join"


class Verify(StrEnum):
    """When the checksum of a member is compared."""

    ALWAYS = "always"
    FIRST = "first"
    NEVER = "never"


@dataclass(frozen=True, kw_only=True)
class SourceConfig:
    """Clips that a loader draws from.

    Attributes:
        release: folder or URL of the release.
        selection: name of a selection of the release, or path of a selection file; empty for all clips of the split.
        split: split of the clips; empty for all splits.
        weight: passes over the source in an epoch. With 0.5, one epoch brings one half of the clips and the next one
            the other half; with 2, every clip comes twice.
    """

    release: str
    selection: str = ""
    split: str = "train"
    weight: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "weight", float(self.weight))  # numpy's floats are not spelled as decimals
        if not 0 < self.weight < math.inf:
            raise ValueError(
                f"weight must be finite and above 0, found {self.weight}; to use none, leave the source out"
            )


@dataclass(frozen=True, kw_only=True)
class OrderConfig:
    """Which clips make up which global step: with the releases, a pure function of seed and epoch.

    Attributes:
        seed: of the order, and of the chunk sizes; 0 to 2^64 - 1.
        shuffle: whether clips are permuted; otherwise they come in the order of the index.
        block_clips: clips of a shard that stay together before the shuffle within a window; 0: the whole shard.
        window_blocks: blocks whose clips are shuffled among one another.
        global_batch: rows of one step over all ranks.
        remainder: what becomes of rows that do not fill a step.
        max_latents: longest sequence, in latents; longer clips are cut to a prefix. 0: whole clips.
        arrangement: one clip a row (`plain`), rows of similar length in a step (`bucket`), or several clips in rows of
            `row_latents` (`join`; elsewhere called sequence packing).
        pool: how far `bucket` and `join` look ahead, in units of their own. `bucket`: so many global steps, whose rows
            it sorts by length. `join`: so many clips, among which it looks for what fits. `plain` has no use for it.
        row_latents: length of a row of joined clips, in latents; only for `join`.
        chunk_sizes: what the chunk size K is drawn from, once for every sequence.
    """

    seed: int = 0
    shuffle: bool = True
    block_clips: int = 0
    window_blocks: int = 4
    global_batch: int = 8
    remainder: Remainder = Remainder.DROP
    max_latents: int = 0
    arrangement: Arrangement = Arrangement.PLAIN
    pool: int = 32
    row_latents: int = 0
    chunk_sizes: tuple[int, ...] = tuple(range(1, MAX_CHUNK_LATENTS + 1))

    def __post_init__(self) -> None:
        object.__setattr__(self, "remainder", Remainder(self.remainder))  # words, as files and users spell them
        object.__setattr__(self, "arrangement", Arrangement(self.arrangement))
        for name in ("window_blocks", "global_batch", "pool"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, found {getattr(self, name)}")
        for name in ("seed", "block_clips", "max_latents", "row_latents"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")
        if self.seed >= 1 << 64:
            raise ValueError(f"seed must be below 2^64, found {self.seed}")
        if (self.arrangement is Arrangement.JOIN) != (self.row_latents > 0):
            raise ValueError("row_latents belongs to arrangement = join, and must be above 0 there")
        if not self.chunk_sizes or min(self.chunk_sizes) < 1:
            raise ValueError(f"chunk_sizes must be numbers of at least 1, found {self.chunk_sizes}")


@dataclass(frozen=True, kw_only=True)
class ReadConfig(AccessConfig):
    """How the bytes of a batch get into memory, beside how a store is asked; none of it changes what is delivered.

    Attributes:
        verify: when checksums are compared: `first` time a process reads a clip, `always`, or `never`.
        threads: threads that read ahead in the training process; 0: everything in the caller's thread.
        prefetch_batches: batches that are read ahead.
        standardise: subtract mean and divide by standard deviation; otherwise latents come as they are stored.
        standard: by which numbers; none: the standard of the first release. A model goes on learning by its own.
        dtype: dtype of the latents of a batch: `float32`, `bfloat16`, or `float16`.
        device: where batches are delivered, as torch spells it.
        pin_memory: read into page-locked memory, so that the transfer to a GPU runs beside the training step.
    """

    verify: Verify = Verify.FIRST
    threads: int = 2
    prefetch_batches: int = 2
    standardise: bool = True
    standard: LatentStandard | None = None
    dtype: str = "float32"
    device: str = "cpu"
    pin_memory: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "verify", Verify(self.verify))  # a word, as files and users spell it
        for name in ("threads", "prefetch_batches"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, found {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True)
class LoaderConfig:
    """Everything a loader is made from.

    Attributes:
        sources: what is mixed.
        order: which clips make up which step.
        read: how they are read.
        depth: whether batches have depth. With it every clip must have depth; without, none is read.
        ledger: folder in which every delivered step is recorded; empty for none.
    """

    sources: tuple[SourceConfig, ...]
    order: OrderConfig = field(default_factory=OrderConfig)
    read: ReadConfig = field(default_factory=ReadConfig)
    depth: bool = True
    ledger: str = ""
