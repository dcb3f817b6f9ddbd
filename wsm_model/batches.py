"""From the batches of a loader to the inputs of the model: noise, flow times, and parts that fit into memory.

Noise and flow times are drawn per sequence from a stream of its own, named by seed, epoch, step and clip: they do not
depend on which rank or which part of a step a sequence falls to.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import torch
from torch import Tensor

from wsm_model.flow import noised, shifted_flow_time
from wsm_model.inputs import ModelInputs
from wsm_model.mot.chunks import SequenceSpan, chunk_bounds


class ClipBatch(Protocol):
    """What a loader must deliver: R rows of L latents that hold N sequences; the rest is padding."""

    @property
    def rgb(self) -> Tensor:
        """Standardised RGB latents [R, L, C, h, w]."""

    @property
    def depth(self) -> Tensor:
        """Standardised depth latents [R, L, C, h, w]."""

    @property
    def poses(self) -> Tensor:
        """Pose slots [R, L, M, 7]: xyz (m) and unit quaternion wxyz in the first camera's frame."""

    @property
    def still(self) -> Tensor:
        """Slots of still frames that were added at the end of a clip, bool [R, L, M]."""

    @property
    def row(self) -> Tensor:
        """Row of each sequence [N]."""

    @property
    def start(self) -> Tensor:
        """First latent of each sequence in its row [N]."""

    @property
    def lengths(self) -> Tensor:
        """Latents of each sequence [N]."""

    @property
    def chunk_size(self) -> Tensor:
        """K of each sequence [N]."""

    @property
    def goal_camera0_m(self) -> Tensor:
        """Goal of each sequence in its first camera's frame [N, 3], m."""

    @property
    def refs(self) -> Tensor:
        """Number of each sequence's clip over all sources [N]."""

    @property
    def keys(self) -> Sequence[str]:
        """Key of each sequence's clip."""

    @property
    def epoch(self) -> int:
        """Epoch of the step."""

    @property
    def step(self) -> int:
        """Step of the epoch."""


@dataclass(frozen=True, kw_only=True)
class TrainingInputs:
    """A part of a step.

    Attributes:
        inputs: of the model.
        noise: eps that the noisy RGB was made with, [R, L, C, h, w].
        keys: clips of the sequences, for messages.
    """

    inputs: ModelInputs
    noise: Tensor
    keys: tuple[str, ...]


def spans_of(batch: ClipBatch) -> list[SequenceSpan]:
    """Where the sequences of a batch stand."""
    columns = (batch.row.tolist(), batch.start.tolist(), batch.lengths.tolist(), batch.chunk_size.tolist())
    return [
        SequenceSpan(row=row, start=start, length=length, chunk_size=size)
        for row, start, length, size in zip(*columns, strict=True)
    ]


def training_inputs(
    batch: ClipBatch, *, seed: int, flow_shift: float, depth_noise: float = 0.0, micro_rows: int = 0
) -> Iterator[TrainingInputs]:
    """Noised inputs of a batch, in parts of at most `micro_rows` rows, each cut to its longest row.

    Args:
        batch: of a loader.
        seed: of the noise.
        flow_shift: gamma of the flow time.
        depth_noise: largest share of noise in the depth that later chunks see; see `TrainingConfig`.
        micro_rows: rows of a part; 0: all.
    """
    spans = spans_of(batch)
    rows = len(batch.rgb)
    for first in range(0, rows, micro_rows or rows):
        end = min(rows, first + (micro_rows or rows))
        chosen = [number for number, span in enumerate(spans) if first <= span.row < end]
        if chosen:
            yield _part(batch, spans, chosen, first, end, _Noise(seed, flow_shift, depth_noise))


class _Noise(NamedTuple):
    seed: int
    flow_shift: float
    depth: float


def _part(
    batch: ClipBatch, spans: Sequence[SequenceSpan], chosen: list[int], first: int, end: int, settings: _Noise
) -> TrainingInputs:
    longest = max(spans[number].start + spans[number].length for number in chosen)
    place = (slice(first, end), slice(0, longest))
    rgb, depth = batch.rgb[place].float(), batch.depth[place].float()
    noise, depth_noise = torch.zeros(rgb.shape), torch.zeros(rgb.shape)
    depth_share = torch.zeros(rgb.shape[:2])
    flow_time = torch.zeros(rgb.shape[:2])
    moved = []
    for number in chosen:
        span = spans[number]
        own = SequenceSpan(row=span.row - first, start=span.start, length=span.length, chunk_size=span.chunk_size)
        moved.append(own)
        stream = noise_stream(settings.seed, batch.epoch, batch.step, int(batch.refs[number]))
        where = (own.row, slice(own.start, own.start + own.length))
        flow_time[where] = chunk_flow_times(own, settings.flow_shift, stream)
        noise[where] = torch.randn(own.length, *rgb.shape[2:], generator=stream)
        if settings.depth:
            depth_share[where] = settings.depth * torch.rand((), generator=stream)
            depth_noise[where] = torch.randn(own.length, *rgb.shape[2:], generator=stream)
    noise, flow_time = noise.to(rgb.device), flow_time.to(rgb.device)
    inputs = ModelInputs(
        rgb=rgb,
        depth=depth,
        poses=batch.poses[place].float(),
        goal_camera0_m=batch.goal_camera0_m[chosen].float(),
        noisy_rgb=noised(rgb, noise, flow_time),
        flow_time=flow_time,
        spans=tuple(moved),
        depth_context=noised(depth, depth_noise.to(rgb.device), depth_share.to(rgb.device)) if settings.depth else None,
    )
    return TrainingInputs(inputs=inputs, noise=noise, keys=tuple(batch.keys[number] for number in chosen))


def noise_stream(seed: int, epoch: int, step: int, ref: int) -> torch.Generator:
    """The random stream of one sequence of one step."""
    digest = hashlib.sha256(f"{seed}/{epoch}/{step}/{ref}".encode()).digest()
    return torch.Generator().manual_seed(int.from_bytes(digest[:8], "little") >> 1)


def chunk_flow_times(span: SequenceSpan, shift: float, stream: torch.Generator) -> Tensor:
    """A flow time for each latent of a sequence, [F], the same within a chunk."""
    bounds = chunk_bounds(span.length, span.chunk_size)
    drawn = shifted_flow_time(torch.rand(len(bounds), generator=stream), shift)
    return torch.cat([time.expand(end - first) for time, (first, end) in zip(drawn, bounds, strict=True)])
