"""Episodes under one model: observe latents, keep the states of the current chunk up to date, dream (paper, 3.4).

Shape suffixes: N episodes, G dreams of each, F frames, M pose slots, C channels, h rows and w columns of a latent.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from wsm_data.schema.sequence import chunk_start
from wsm_model.config import Variant
from wsm_model.inference.cache import FrameCache, KeysValues
from wsm_model.inference.passes import (
    History,
    Layers,
    States,
    clean_rgb,
    clean_states,
    query_states,
    velocity,
)
from wsm_model.inference.sampler import integrate
from wsm_model.layers.pose import identity_poses
from wsm_model.model import WorldSlamModel


@dataclass(frozen=True, kw_only=True)
class SessionConfig:
    """How an episode is run.

    Attributes:
        chunk_size: K, latents of a chunk (paper: 4).
        cache_latents: most observed latents that are kept, the anchor among them (paper: 128).
        local_backend: estimate the whole current chunk again with each new latent (paper, equation 4); otherwise each
            state is estimated once and kept.
    """

    chunk_size: int = 4
    cache_latents: int = 128
    local_backend: bool = True

    def __post_init__(self) -> None:
        if not 1 <= self.chunk_size < self.cache_latents:
            raise ValueError(
                f"a cache of {self.cache_latents} latents must hold the anchor and a chunk of at least one, found a "
                f"chunk of {self.chunk_size}"
            )


@dataclass(kw_only=True)
class Episode:
    """What is known of one environment. It changes as its latents are observed; a reset is a new one.

    Attributes:
        history: keys and values of what was observed.
        observed: latents observed so far.
    """

    history: History
    observed: int = 0


@dataclass(frozen=True, kw_only=True)
class StateEstimate:
    """Metric states of consecutive latents of one episode.

    Attributes:
        first: number of the first latent.
        depth: standardised depth latents [F, C, h, w]; None without SLAM.
        poses: [F, M, 7]: xyz (m) and unit quaternion wxyz, in the first camera's frame.
    """

    first: int
    depth: Tensor | None
    poses: Tensor


@dataclass(frozen=True, kw_only=True)
class Dream:
    """What the model expects to see of an episode, and where it would be: G dreams from one history.

    Attributes:
        first: number of the first latent.
        rgb: standardised RGB latents [G, F, C, h, w].
        depth: standardised depth latents [G, F, C, h, w]; None without SLAM.
        poses: [G, F, M, 7], as in `StateEstimate`.
    """

    first: int
    rgb: Tensor
    depth: Tensor | None
    poses: Tensor


class Session:
    """Serves any number of episodes, each at a latent of its own; those of one call are computed together.

    What comes of an episode does not depend, but for rounding, on which others it is computed with.

    Args:
        model: in evaluation mode.
        config: chunk size and cache.
    """

    def __init__(self, model: WorldSlamModel, config: SessionConfig):
        self.model = model
        self.config = config
        self._is_slam = model.config.variant is Variant.SLAM

    def start(self) -> Episode:
        """An episode of which nothing was observed yet."""
        layers, limit = self.model.config.layers, self.config.cache_latents
        return Episode(history=History(rgb=FrameCache(layers, limit), state=FrameCache(layers, limit)))

    @torch.no_grad()
    def observe(
        self, episodes: Sequence[Episode], rgb: Tensor, known: Sequence[StateEstimate | None] | None = None
    ) -> list[StateEstimate]:
        """Take in the next latent of each episode and estimate the states of its current chunk.

        The anchor's pose is the identity, exactly, as in training: it is by definition, and is not estimated.

        Args:
            episodes: all different.
            rgb: standardised RGB latents [N, C, h, w].
            known: states to remember in place of the estimates, as in teacher forcing; None where there are none.
                Without SLAM nothing is estimated, and these are the poses issued before, needed of all but anchors.

        Returns:
            Of each episode the states of the current chunk up to this latent; of this latent alone without the local
            backend.

        Raises:
            ValueError: without SLAM, a latent after the anchor has no known poses.
        """
        histories, numbers = [one.history for one in episodes], [one.observed for one in episodes]
        for history in histories:
            self._make_room(history)
        passed = clean_rgb(self.model, histories, rgb.unsqueeze(1), numbers)
        for row, episode in enumerate(episodes):
            _keep(episode.history.rgb, passed, row, numbers[row])
            episode.observed += 1
        given = known or [None] * len(episodes)
        states = self._estimates(histories, numbers) if self._is_slam else self._issued(numbers, given, rgb.device)
        self._remember(histories, [own or state for own, state in zip(given, states, strict=True)])
        return states

    @torch.no_grad()
    def dream(
        self, episodes: Sequence[Episode], goal_camera0_m: Tensor, noise: Tensor, schedule: Sequence[float]
    ) -> list[Dream]:
        """Dream a chunk after what was observed, and estimate its states; the episodes stay as they are.

        Args:
            episodes: of which anything was observed.
            goal_camera0_m: goals in the first cameras' frames [N, 3], m.
            noise: where the flow starts, [N, G, F, C, h, w]: G dreams of each episode share its history.
            schedule: flow times, from 1 to 0.

        Raises:
            ValueError: nothing was observed yet.
        """
        if not all(one.observed for one in episodes):
            raise ValueError("a dream needs at least one observed latent; call observe first")
        dreams, frames = noise.shape[1:3]
        rows = [one for one in episodes for _ in range(dreams)]
        histories, firsts = [one.history for one in rows], [one.observed for one in rows]
        goals = self.model.goal(goal_camera0_m).repeat_interleave(dreams, dim=0)
        context = goals[:, None, None].expand(-1, frames, -1, -1)

        def flow(x: Tensor, flow_time: float) -> Tensor:
            return velocity(self.model, histories, x, flow_time, firsts, context)

        rgb = integrate(flow, noise.flatten(0, 1), list(schedule))
        clean = clean_rgb(self.model, histories, rgb, firsts)
        states = query_states(self.model, histories, firsts, frames, dreamed=clean, context=context)
        found = []
        for number, episode in enumerate(episodes):
            own = slice(number * dreams, (number + 1) * dreams)
            depth = None if states.depth is None else states.depth[own]
            found.append(Dream(first=episode.observed, rgb=rgb[own], depth=depth, poses=states.poses[own]))
        return found

    def _estimates(self, histories: Sequence[History], numbers: Sequence[int]) -> list[StateEstimate]:
        size = self.config.chunk_size
        firsts = [chunk_start(one, size) if self.config.local_backend else one for one in numbers]
        found: dict[int, StateEstimate] = {}
        for frames, rows in _alike([number + 1 - first for number, first in zip(numbers, firsts, strict=True)]):
            own = [firsts[row] for row in rows]
            states = query_states(self.model, [histories[row] for row in rows], own, frames)
            for place, row in enumerate(rows):
                depth = None if states.depth is None else states.depth[place]
                found[row] = StateEstimate(first=own[place], depth=depth, poses=states.poses[place])
        return [_anchored(found[row]) for row in range(len(numbers))]

    def _issued(
        self, numbers: Sequence[int], known: Sequence[StateEstimate | None], device: torch.device
    ) -> list[StateEstimate]:
        anchor = identity_poses(1, self.model.config.pose_slots, device=device)
        found = []
        for number, own in zip(numbers, known, strict=True):
            if own is None and number:
                raise ValueError(
                    f"latent {number} needs the poses that were issued for it: without SLAM none are estimated"
                )
            found.append(own or StateEstimate(first=0, depth=None, poses=anchor))
        return found

    def _remember(self, histories: Sequence[History], states: Sequence[StateEstimate]) -> None:
        """Pass states as clean tokens, those of equally many latents together, and keep keys and values."""
        for _, rows in _alike([len(one.poses) for one in states]):
            chosen = [states[row] for row in rows]
            depth = [one.depth for one in chosen if one.depth is not None]
            joined = States(
                depth=torch.stack(depth) if len(depth) == len(chosen) else None,
                poses=torch.stack([one.poses for one in chosen]),
            )
            firsts, own = [one.first for one in chosen], [histories[row] for row in rows]
            passed = clean_states(self.model, own, joined, firsts)
            for place, history in enumerate(own):
                _keep(history.state, passed, place, firsts[place])

    def _make_room(self, history: History) -> None:
        if history.state.held == self.config.cache_latents:
            history.rgb.drop_oldest()
            history.state.drop_oldest()


def _anchored(estimate: StateEstimate) -> StateEstimate:
    """The same estimate, with the identity for the pose of the anchor."""
    if estimate.first:
        return estimate
    shape, device = estimate.poses.shape[:-1], estimate.poses.device
    return replace(estimate, poses=identity_poses(*shape, device=device))


def _alike(values: Sequence[int]) -> list[tuple[int, list[int]]]:
    """Each value with the places where it stands."""
    places: dict[int, list[int]] = defaultdict(list)
    for place, value in enumerate(values):
        places[value].append(place)
    return list(places.items())


def _keep(cache: FrameCache, passed: Layers, row: int, first: int) -> None:
    for layer, (keys, values) in enumerate(passed):
        cache.write(layer, first, KeysValues(keys[row], values[row]))
