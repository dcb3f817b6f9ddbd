"""The four passes of inference, each one row of the mask's table evaluated against what was kept.

A pass takes rows of different episodes together: each row has a history of its own, of any length, and several rows may
share one, as dreams of one episode do. Only the attention goes row by row. Tokens of a pass are written behind the
history of their row and stay there until the next pass: the caller says whether they are kept.

Shape suffixes: B rows, F frames of the pass, P tokens of a frame, M pose slots, C channels, h rows and w columns of a
latent, H heads, d width of a head, L tokens.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import scaled_dot_product_attention

from wsm_model.config import Expert, Variant
from wsm_model.flow import velocity_of
from wsm_model.inference.cache import History, KeysValues, Side, by_head
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


@dataclass(frozen=True, kw_only=True)
class Reach:
    """What the tokens of a pass may see beside one another.

    Attributes:
        own: which side they stand on.
        sides: of the history.
        dreamed: clean RGB of the same frames, where it was dreamed.
        is_causal: a frame does not see the frames of the pass that follow it.
    """

    own: Side
    sides: frozenset[Side]
    dreamed: Layers | None = None
    is_causal: bool = False


def clean_rgb(model: MixtureOfTransformers, histories: Sequence[History], rgb: Tensor) -> Layers:
    """Pass the next latents [B, F, C, h, w] as clean RGB: each sees the clean RGB before it, and itself."""
    latents, firsts = rgb.unsqueeze(1), [history.rgb.next for history in histories]
    stream = model.expert(Expert.GENERATION).stream(latents, _times(latents, 0.0), _numbers(latents, firsts), None)
    return _run_clean(model, histories, {Expert.GENERATION: stream}, Side.RGB)


def clean_states(model: MixtureOfTransformers, histories: Sequence[History], states: States) -> Layers:
    """Pass the states of the next latents as clean depth and poses: each sees those before it, and itself."""
    firsts = [history.state.next for history in histories]
    streams = _state_streams(model, states, firsts, model.config.clean_state_time, None)
    return _run_clean(model, histories, streams, Side.STATE)


def query_states(
    model: MixtureOfTransformers,
    histories: Sequence[History],
    frames: int,
    *,
    dreamed: Layers | None = None,
    context: Tensor | None = None,
) -> States:
    """Estimate the states of the next chunk of each row: of `frames` latents after those whose states are kept.

    They see the clean RGB up to the chunk's end, the clean states before it, and one another.

    Args:
        model: the model.
        histories: of each row; unless it is dreamed, the clean RGB of the chunk is kept and none after it.
        frames: length of the chunk.
        dreamed: clean RGB of the chunk, where it was dreamed.
        context: goal tokens [B, F, 1, D], only for the variant without SLAM.
    """
    config, rows = model.config, len(histories)
    device = next(model.parameters()).device
    latents = torch.zeros(
        rows, frames, config.latent_channels, config.latent_height, config.latent_width, device=device
    )
    asked = States(depth=latents, poses=identity_poses(rows, frames, config.pose_slots, device=device))
    firsts = [history.state.next for history in histories]
    streams = _state_streams(model, asked, firsts, config.state_query_time, 0)
    reach = Reach(own=Side.STATE, sides=frozenset(Side), dreamed=dreamed)
    done = model.run(streams, lambda layer, tokens: _gather(tokens, layer, histories, reach), context)
    return States(
        depth=model.expert(Expert.DEPTH).read(done[Expert.DEPTH]).float() if Expert.DEPTH in done else None,
        poses=model.expert(Expert.POSE).read(done[Expert.POSE]),
    )


def velocity(
    model: MixtureOfTransformers,
    histories: Sequence[History],
    noisy: Tensor,
    flow_time: float | Tensor,
    context: Tensor,
) -> Tensor:
    """Velocity of the noisy RGB latents of the next chunk, [B, F, C, h, w], from all that is known before it.

    Args:
        model: the model.
        histories: of each row.
        noisy: x_tau, [B, F, C, h, w].
        flow_time: tau, one for all or one a row [B].
        context: goal tokens [B, F, 1, D].
    """
    expert = model.expert(Expert.GENERATION)
    latents, firsts = noisy.unsqueeze(1), [history.rgb.next for history in histories]
    tau = torch.as_tensor(flow_time, dtype=torch.float32, device=noisy.device).expand(len(noisy))[:, None]
    times = (tau * FLOW_TIME_SCALE)[:, None].expand(latents.shape[:3])
    stream = expert.stream(latents, times, _numbers(latents, firsts), 0)
    sees_states = model.config.variant is Variant.SLAM
    reach = Reach(own=Side.RGB, sides=frozenset(Side) if sees_states else frozenset({Side.RGB}))
    done = model.run(
        {Expert.GENERATION: stream}, lambda layer, tokens: _gather(tokens, layer, histories, reach), context
    )
    read = expert.read(done[Expert.GENERATION]).float()
    return velocity_of(model.config.prediction, read, noisy, tau.expand(noisy.shape[:2]))


def _run_clean(
    model: MixtureOfTransformers, histories: Sequence[History], streams: dict[Expert, Stream], side: Side
) -> Layers:
    """Clean tokens over their own kind, each frame up to itself."""
    passed: Layers = []
    reach = Reach(own=side, sides=frozenset({side}), is_causal=True)

    def attend(layer: int, tokens: JointTokens) -> Attended:
        passed.append(_own(tokens))
        return _gather(tokens, layer, histories, reach)

    model.run(streams, attend, None)
    return passed


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


def _gather(tokens: JointTokens, layer: int, histories: Sequence[History], reach: Reach) -> Attended:
    """The tokens of each row, [B, 1, F, P, H, d] of each expert, attend to what is in reach and to one another."""
    own = _own(tokens)
    queries = torch.cat([part.queries[:, 0] for part in tokens.values()], dim=2)
    frames = queries.shape[1]
    stretches = [slice(frame, frame + 1) for frame in range(frames)] if reach.is_causal else [slice(0, frames)]
    gathered = torch.empty_like(queries)
    for row, history in enumerate(histories):
        brought = {reach.own: _row(own, row)}
        if reach.dreamed is not None:
            brought[Side.RGB] = _row(reach.dreamed[layer], row)
        find = _join_behind if own.keys.requires_grad else _write_behind
        for place in stretches:
            until = {side: _first(new, place.stop) for side, new in brought.items()}
            keys, values = find(history, layer, reach.sides, until)
            asked = queries[row, place]
            found = scaled_dot_product_attention(by_head(asked)[None], keys[None], values[None])
            gathered[row, place] = found[0].transpose(0, 1).reshape(asked.shape)
    sizes = [part.queries.shape[3] for part in tokens.values()]
    return dict(zip(tokens, gathered.unsqueeze(1).split(sizes, dim=3), strict=True))


def _write_behind(
    history: History, layer: int, sides: frozenset[Side], brought: Mapping[Side, KeysValues]
) -> KeysValues:
    """What is kept and what is brought, [H, L, d] each: a view of the history's memory."""
    counts = {side: history.held(side) if side in sides else 0 for side in Side}
    for side, new in brought.items():
        history.write(layer, side, new)
        counts[side] += len(new.keys)
    return history.read(layer, counts[Side.RGB], counts[Side.STATE])


def _join_behind(
    history: History, layer: int, sides: frozenset[Side], brought: Mapping[Side, KeysValues]
) -> KeysValues:
    """The same as a copy: gradients flow through what is brought, which no later layer may write over."""
    kept = history.read(layer, *(history.held(side) if side in sides else 0 for side in (Side.RGB, Side.STATE)))
    parts = [kept, *(KeysValues(*(by_head(part) for part in new)) for new in brought.values())]
    return KeysValues(*(torch.cat(part, dim=1) for part in zip(*parts, strict=True)))


def _first(frames: KeysValues, end: int) -> KeysValues:
    return KeysValues(frames.keys[:end], frames.values[:end])
