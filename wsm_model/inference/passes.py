"""The four passes of inference, each one row of the mask's table evaluated against the cache.

Shape suffixes: B batch, F frames of the pass, M pose slots, C channels, h rows and w columns of a latent.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_model.config import Expert, Variant
from wsm_model.inference.cache import FrameCache, joined
from wsm_model.layers.pose import identity_poses
from wsm_model.model import FLOW_TIME_SCALE
from wsm_model.mot.attention import Attended, JointTokens
from wsm_model.mot.expert import Stream
from wsm_model.mot.transformer import MixtureOfTransformers


@dataclass(frozen=True, kw_only=True)
class StateEstimate:
    """Metric states of consecutive latents.

    Attributes:
        first: number of the first latent.
        depth: standardised depth latents [B, F, C, h, w]; None without SLAM.
        poses: [B, F, M, 7]: xyz (m) and unit quaternion wxyz, in the first camera's frame.
    """

    first: int
    depth: Tensor | None
    poses: Tensor


@dataclass(frozen=True)
class History:
    """Caches of clean RGB and clean state tokens of one model."""

    rgb: FrameCache
    state: FrameCache


def write_rgb(model: MixtureOfTransformers, history: History, rgb: Tensor, first: int) -> None:
    """Pass latents [B, F, C, h, w], numbered from `first`, as clean RGB one by one, and keep keys and values."""
    expert = model.expert(Expert.GENERATION)
    for offset in range(rgb.shape[1]):
        number = first + offset
        latent = rgb[:, offset : offset + 1].unsqueeze(1)
        stream = expert.stream(latent, _times(latent, 0.0), _numbers(latent, number), None)
        _run_clean(model, {Expert.GENERATION: stream}, history.rgb, number)


def write_states(model: MixtureOfTransformers, history: History, states: StateEstimate) -> None:
    """Pass states as clean depth and poses, one latent after the other, and keep keys and values."""
    for offset in range(states.poses.shape[1]):
        frame = slice(offset, offset + 1)
        streams = _state_streams(model, states, frame, model.config.clean_state_time, None)
        _run_clean(model, streams, history.state, states.first + offset)


def query_states(
    model: MixtureOfTransformers,
    history: History,
    first: int,
    frames: int,
    rows: int,
    context: Tensor | None = None,
) -> StateEstimate:
    """Estimate the states of one chunk: `frames` latents from number `first` on.

    They see the clean RGB up to the chunk's end, the clean states before it, and one another.

    Args:
        model: the model.
        history: caches; the clean RGB of the chunk must be there.
        first: number of the chunk's first latent.
        frames: its length.
        rows: B.
        context: goal tokens [B, F, 1, D], only for the variant without SLAM.
    """
    config = model.config
    device = next(model.parameters()).device
    latents = torch.zeros(
        rows, frames, config.latent_channels, config.latent_height, config.latent_width, device=device
    )
    asked = StateEstimate(
        first=first, depth=latents, poses=identity_poses(rows, frames, config.pose_slots, device=device)
    )
    streams = _state_streams(model, asked, slice(0, frames), config.state_query_time, 0)

    def attend(layer: int, tokens: JointTokens) -> Attended:
        keys, values = _own(tokens)
        return _gather(
            tokens,
            joined([history.rgb.read(layer, first + frames), history.state.read(layer, first), (keys, values)]),
        )

    done = model.run(streams, attend, context)
    return StateEstimate(
        first=first,
        depth=model.expert(Expert.DEPTH).read(done[Expert.DEPTH]) if Expert.DEPTH in done else None,
        poses=model.expert(Expert.POSE).read(done[Expert.POSE]),
    )


def velocity(
    model: MixtureOfTransformers, history: History, noisy: Tensor, flow_time: float, first: int, context: Tensor
) -> Tensor:
    """Velocity of the noisy RGB latents of one chunk, [B, F, C, h, w], from all that is known before it.

    Args:
        model: the model.
        history: caches.
        noisy: x_tau, [B, F, C, h, w].
        flow_time: tau.
        first: number of the chunk's first latent.
        context: goal tokens [B, F, 1, D].
    """
    expert = model.expert(Expert.GENERATION)
    latents = noisy.unsqueeze(1)
    stream = expert.stream(latents, _times(latents, flow_time * FLOW_TIME_SCALE), _numbers(latents, first), 0)
    sees_states = model.config.variant is Variant.SLAM

    def attend(layer: int, tokens: JointTokens) -> Attended:
        states = history.state.read(layer, first) if sees_states else None
        return _gather(tokens, joined([history.rgb.read(layer, first), states, _own(tokens)]))

    return expert.read(model.run({Expert.GENERATION: stream}, attend, context)[Expert.GENERATION])


def _run_clean(model: MixtureOfTransformers, streams: dict[Expert, Stream], cache: FrameCache, number: int) -> None:
    """One frame of clean tokens over its own kind up to itself; its keys and values go into the cache."""

    def attend(layer: int, tokens: JointTokens) -> Attended:
        cache.write(layer, number, *_own(tokens))
        past = cache.read(layer, number + 1)
        return _gather(tokens, joined([past]))

    model.run(streams, attend, None)


def _state_streams(
    model: MixtureOfTransformers, states: StateEstimate, frames: slice, time: float, prediction: int | None
) -> dict[Expert, Stream]:
    values = {Expert.DEPTH: states.depth, Expert.POSE: states.poses}
    streams = {}
    for expert in model.config.state_experts:
        chosen = values[expert]
        if chosen is None:
            raise ValueError("states of a model with SLAM need depth latents beside their poses, found none")
        part = chosen[:, frames].unsqueeze(1)
        numbers = _numbers(part, states.first + frames.start)
        streams[expert] = model.expert(expert).stream(part, _times(part, time), numbers, prediction)
    return streams


def _times(values: Tensor, time: float) -> Tensor:
    """The same timestep for every frame, [B, G, F]."""
    return torch.full(values.shape[:3], time, device=values.device)


def _numbers(values: Tensor, first: int) -> Tensor:
    """Numbers of consecutive latents, [B, F]."""
    rows, _, frames = values.shape[:3]
    return torch.arange(first, first + frames, device=values.device).expand(rows, frames)


def _own(tokens: JointTokens) -> tuple[Tensor, Tensor]:
    """Keys and values of the tokens of all experts of a frame, side by side: [B, F, P, H, d]."""
    return tuple(
        torch.cat([getattr(part, name)[:, 0] for part in tokens.values()], dim=2) for name in ("keys", "values")
    )  # type: ignore[return-value]


def _gather(tokens: JointTokens, seen: tuple[Tensor, Tensor]) -> Attended:
    """Every token attends to all that is seen."""
    keys, values = (part.transpose(1, 2) for part in seen)
    gathered = {}
    for expert, part in tokens.items():
        queries = part.queries.flatten(1, 3).transpose(1, 2)
        found = scaled_dot_product_attention(queries, keys, values)
        gathered[expert] = found.transpose(1, 2).reshape(part.queries.shape)
    return gathered
