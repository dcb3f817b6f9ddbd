"""The four passes of inference, each one row of the mask's table evaluated against what was kept.

A pass takes rows of different episodes together: each row has a history of its own, of any length, and several rows may
share one, as dreams of one episode do. Only the attention goes row by row; a history is never copied for its rows.

Shape suffixes: B rows, F frames of the pass, M pose slots, C channels, h rows and w columns of a latent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_model.config import Expert, Variant
from wsm_model.inference.cache import FrameCache, KeysValues
from wsm_model.layers.pose import identity_poses
from wsm_model.model import FLOW_TIME_SCALE
from wsm_model.mot.attention import Attended, JointTokens
from wsm_model.mot.expert import Stream
from wsm_model.mot.transformer import MixtureOfTransformers

Layers = list[KeysValues]
"""Keys and values of the tokens of a pass, in each layer: [B, F, P, H, d]."""


@dataclass(frozen=True, kw_only=True)
class States:
    """Metric states of consecutive latents, of several rows.

    Attributes:
        depth: standardised depth latents [B, F, C, h, w]; None without SLAM.
        poses: [B, F, M, 7]: xyz (m) and unit quaternion wxyz, in the first camera's frame.
    """

    depth: Tensor | None
    poses: Tensor


@dataclass(frozen=True)
class History:
    """Caches of clean RGB and clean state tokens of one episode."""

    rgb: FrameCache
    state: FrameCache


def clean_rgb(model: MixtureOfTransformers, histories: Sequence[History], rgb: Tensor, firsts: Sequence[int]) -> Layers:
    """Pass latents as clean RGB: each sees the clean RGB before it, and itself.

    Args:
        model: the model.
        histories: of each row.
        rgb: latents [B, F, C, h, w].
        firsts: number of each row's first latent.
    """
    latents = rgb.unsqueeze(1)
    stream = model.expert(Expert.GENERATION).stream(latents, _times(latents, 0.0), _numbers(latents, firsts), None)
    return _run_clean(model, {Expert.GENERATION: stream}, [history.rgb for history in histories], firsts)


def clean_states(
    model: MixtureOfTransformers, histories: Sequence[History], states: States, firsts: Sequence[int]
) -> Layers:
    """Pass states as clean depth and poses: each sees the clean states before it, and itself."""
    streams = _state_streams(model, states, firsts, model.config.clean_state_time, None)
    return _run_clean(model, streams, [history.state for history in histories], firsts)


def query_states(
    model: MixtureOfTransformers,
    histories: Sequence[History],
    firsts: Sequence[int],
    frames: int,
    *,
    dreamed: Layers | None = None,
    context: Tensor | None = None,
) -> States:
    """Estimate the states of one chunk of each row: `frames` latents.

    They see the clean RGB up to the chunk's end, the clean states before it, and one another.

    Args:
        model: the model.
        histories: of each row; unless it is dreamed, the clean RGB of the chunk must be there.
        firsts: number of the chunk's first latent, of each row.
        frames: its length.
        dreamed: clean RGB of the chunk, where it was dreamed.
        context: goal tokens [B, F, 1, D], only for the variant without SLAM.
    """
    config, rows = model.config, len(histories)
    device = next(model.parameters()).device
    latents = torch.zeros(
        rows, frames, config.latent_channels, config.latent_height, config.latent_width, device=device
    )
    asked = States(depth=latents, poses=identity_poses(rows, frames, config.pose_slots, device=device))
    streams = _state_streams(model, asked, firsts, config.state_query_time, 0)

    def before(layer: int, row: int) -> list[KeysValues]:
        history, first = histories[row], firsts[row]
        states = history.state.read(layer, first)
        if dreamed is None:
            return [*history.rgb.read(layer, first + frames), *states]
        return [*history.rgb.read(layer, first), _row(dreamed[layer], row), *states]

    done = model.run(streams, lambda layer, tokens: _gather(tokens, layer, before), context)
    return States(
        depth=model.expert(Expert.DEPTH).read(done[Expert.DEPTH]) if Expert.DEPTH in done else None,
        poses=model.expert(Expert.POSE).read(done[Expert.POSE]),
    )


def velocity(
    model: MixtureOfTransformers,
    histories: Sequence[History],
    noisy: Tensor,
    flow_time: float,
    firsts: Sequence[int],
    context: Tensor,
) -> Tensor:
    """Velocity of the noisy RGB latents of one chunk, [B, F, C, h, w], from all that is known before it.

    Args:
        model: the model.
        histories: of each row.
        noisy: x_tau, [B, F, C, h, w].
        flow_time: tau.
        firsts: number of the chunk's first latent, of each row.
        context: goal tokens [B, F, 1, D].
    """
    expert = model.expert(Expert.GENERATION)
    latents = noisy.unsqueeze(1)
    stream = expert.stream(latents, _times(latents, flow_time * FLOW_TIME_SCALE), _numbers(latents, firsts), 0)
    sees_states = model.config.variant is Variant.SLAM

    def before(layer: int, row: int) -> list[KeysValues]:
        history, first = histories[row], firsts[row]
        states = history.state.read(layer, first) if sees_states else []
        return [*history.rgb.read(layer, first), *states]

    done = model.run({Expert.GENERATION: stream}, lambda layer, tokens: _gather(tokens, layer, before), context)
    return expert.read(done[Expert.GENERATION])


def _run_clean(
    model: MixtureOfTransformers, streams: dict[Expert, Stream], caches: Sequence[FrameCache], firsts: Sequence[int]
) -> Layers:
    """Clean tokens over their own kind, each frame up to itself."""
    kept: Layers = []

    def before(layer: int, row: int) -> list[KeysValues]:
        return caches[row].read(layer, firsts[row])

    def attend(layer: int, tokens: JointTokens) -> Attended:
        kept.append(_own(tokens))
        return _gather(tokens, layer, before, is_causal=True)

    model.run(streams, attend, None)
    return kept


def _state_streams(
    model: MixtureOfTransformers, states: States, firsts: Sequence[int], time: float, prediction: int | None
) -> dict[Expert, Stream]:
    values = {Expert.DEPTH: states.depth, Expert.POSE: states.poses}
    streams = {}
    for expert in model.config.state_experts:
        chosen = values[expert]
        if chosen is None:
            raise ValueError("states of a model with SLAM need depth latents beside their poses, found none")
        part = chosen.unsqueeze(1)
        streams[expert] = model.expert(expert).stream(part, _times(part, time), _numbers(part, firsts), prediction)
    return streams


def _times(values: Tensor, time: float) -> Tensor:
    """The same timestep for every frame, [B, G, F]."""
    return torch.full(values.shape[:3], time, device=values.device)


def _numbers(values: Tensor, firsts: Sequence[int]) -> Tensor:
    """Numbers of consecutive latents from each row's first on, [B, F]."""
    offsets = torch.arange(values.shape[2], device=values.device)
    return torch.tensor(firsts, device=values.device)[:, None] + offsets


def _own(tokens: JointTokens) -> KeysValues:
    """Keys and values of the tokens of all experts of a frame, side by side: [B, F, P, H, d]."""
    return KeysValues(
        torch.cat([part.keys[:, 0] for part in tokens.values()], dim=2),
        torch.cat([part.values[:, 0] for part in tokens.values()], dim=2),
    )


def _row(of_rows: KeysValues, row: int) -> KeysValues:
    return KeysValues(of_rows.keys[row], of_rows.values[row])


def _gather(
    tokens: JointTokens, layer: int, before: Callable[[int, int], list[KeysValues]], *, is_causal: bool = False
) -> Attended:
    """The tokens of each row attend to what is `before` them, by layer and row, and to one another.

    Args:
        tokens: of the experts that take part, [B, 1, F, P, H, d].
        layer: number of the layer.
        before: what a row sees beside its own tokens.
        is_causal: a frame does not see the frames that follow it.
    """
    own = _own(tokens)
    frames, of_frame = own.keys.shape[1:3]
    queries = [slice(frame, frame + 1) for frame in range(frames)] if is_causal else [slice(0, frames)]
    found = {expert: torch.empty_like(part.queries) for expert, part in tokens.items()}
    for row in range(len(own.keys)):
        seen = [*before(layer, row), _row(own, row)]
        keys, values = (torch.cat([part[i].flatten(0, 1) for part in seen]).transpose(0, 1) for i in range(2))
        for place in queries:
            end = keys.shape[1] - (frames - place.stop) * of_frame
            for expert, part in tokens.items():
                asked = part.queries[row, 0, place]
                gathered = scaled_dot_product_attention(
                    asked.flatten(0, 1).transpose(0, 1)[None], keys[None, :, :end], values[None, :, :end]
                )
                found[expert][row, 0, place] = gathered[0].transpose(0, 1).reshape(asked.shape)
    return found
