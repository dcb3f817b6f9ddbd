"""From the batches of a loader to the inputs of the model: noise, flow times, and parts that fit into memory.

Noise and flow times are drawn per sequence from a stream of its own, named by seed, epoch, step and clip: they do not
depend on which rank or which part of a step a sequence falls to.
"""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import torch
from torch import Tensor

from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import SequenceSpan, chunk_bounds
from wsm_model.flow import noised, shifted_flow_time
from wsm_model.inputs import ModelInputs


@dataclass(frozen=True, kw_only=True)
class ContextNoise:
    """Noise in the latents x that later chunks see: (1 - s) x + s eps, with s drawn for each sequence up to a bound.

    Attributes:
        depth: largest s of depth latents; 0: none has noise.
        rgb: largest s of RGB latents; 0: none has noise.
        rgb_probability: that a sequence has noise in its RGB.
    """

    depth: float = 0.0
    rgb: float = 0.0
    rgb_probability: float = 0.5


CLEAN = ContextNoise()
"""Later chunks see the truth."""


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


def training_inputs(
    batch: ClipBatch[Tensor],
    *,
    seed: int,
    flow_shift: float,
    context: ContextNoise = CLEAN,
    micro_rows: int = 0,
) -> Iterator[TrainingInputs]:
    """Noised inputs of a batch, in parts of at most `micro_rows` rows, each cut to its longest row.

    Args:
        batch: of a loader.
        seed: of the noise.
        flow_shift: gamma of the flow time.
        context: noise in what later chunks see.
        micro_rows: rows of a part; 0: all.
    """
    rows = len(batch.rgb)
    for first in range(0, rows, micro_rows or rows):
        end = min(rows, first + (micro_rows or rows))
        chosen = [number for number, span in enumerate(batch.spans) if first <= span.row < end]
        if chosen:
            yield _part(batch, chosen, slice(first, end), _Noise(seed, flow_shift, context))


class _Noise(NamedTuple):
    seed: int
    flow_shift: float
    context: ContextNoise


class _Shares:
    """Noise of a context, and its share in each latent, filled sequence by sequence."""

    def __init__(self, like: Tensor):
        self.noise, self.share = torch.zeros(like.shape), torch.zeros(like.shape[:2])

    def draw(self, span: SequenceSpan, largest: float, stream: torch.Generator) -> None:
        self.share[span.place] = largest * torch.rand((), generator=stream)
        self.noise[span.place] = torch.randn(span.length, *self.noise.shape[2:], generator=stream)

    def into(self, latents: Tensor) -> Tensor:
        return noised(latents, self.noise.to(latents.device), self.share.to(latents.device))


def _part(batch: ClipBatch[Tensor], chosen: list[int], rows: slice, settings: _Noise) -> TrainingInputs:
    spans = {number: replace(batch.spans[number], row=batch.spans[number].row - rows.start) for number in chosen}
    place = (rows, slice(0, max(span.end for span in spans.values())))
    rgb, depth = batch.rgb[place].float(), None if batch.depth is None else batch.depth[place].float()
    noise, of_depth, of_rgb = torch.zeros(rgb.shape), _Shares(rgb), _Shares(rgb)
    context = settings.context
    flow_time = torch.zeros(rgb.shape[:2])
    for number, span in spans.items():
        stream = noise_stream(settings.seed, batch.epoch, batch.step, int(batch.refs[number]))
        flow_time[span.place] = chunk_flow_times(span, settings.flow_shift, stream)
        noise[span.place] = torch.randn(span.length, *rgb.shape[2:], generator=stream)
        if context.depth and depth is not None:
            of_depth.draw(span, context.depth, stream)
        if context.rgb and torch.rand((), generator=stream) < context.rgb_probability:
            of_rgb.draw(span, context.rgb, stream)
    noise, flow_time = noise.to(rgb.device), flow_time.to(rgb.device)
    inputs = ModelInputs(
        rgb=rgb,
        depth=depth,
        poses=batch.poses[place].float(),
        goal_camera0_m=batch.goal_camera0_m[chosen].float(),
        noisy_rgb=noised(rgb, noise, flow_time),
        flow_time=flow_time,
        spans=tuple(spans.values()),
        depth_context=of_depth.into(depth) if context.depth and depth is not None else None,
        rgb_context=of_rgb.into(rgb) if context.rgb else None,
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
