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
from wsm_model.inference.cache import History
from wsm_model.inference.passes import (
    States,
    clean_rgb,
    clean_states,
    query_states,
    velocity,
)
from wsm_model.inference.sampler import integrate
from wsm_model.layers.pose import identity_poses
from wsm_model.model import WorldSlamModel
from wsm_model.precision import autocast, stored_precision


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
    """

    history: History

    @property
    def observed(self) -> int:
        """Latents observed so far."""
        return self.history.rgb.next


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
        model: in evaluation mode, its matrices float32 or, to the bit as under autocast, bfloat16.
        config: chunk size and cache.
    """

    def __init__(self, model: WorldSlamModel, config: SessionConfig):
        self.model = model
        self.config = config
        self._is_slam = model.config.variant is Variant.SLAM

    def start(self) -> Episode:
        """An episode of which nothing was observed yet."""
        return Episode(history=History(self.model.config, self.config.cache_latents, self.config.chunk_size))

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
        return self._take_in(episodes, rgb.unsqueeze(1), known or [None] * len(episodes))

    def observe_all(self, episode: Episode, rgb_FChw: Tensor) -> StateEstimate:
        """Take in the next latents of one episode, and estimate their states.

        With the local backend a whole chunk is one step: what is estimated of it before its last latent would be
        estimated again. While latents are dropped, it is one step a latent.

        Returns:
            States of the latents as they were estimated last, from the first of the current chunk on.

        Raises:
            ValueError: without SLAM, which estimates nothing of what it sees.
        """
        parts: list[StateEstimate] = []
        while len(rgb_FChw):
            frames = min(self._latents_at_once(episode), len(rgb_FChw))
            (found,) = self._take_in([episode], rgb_FChw[None, :frames], [None])
            if parts and parts[-1].first == found.first:
                parts.pop()
            parts.append(found)
            rgb_FChw = rgb_FChw[frames:]
        depth = [part.depth for part in parts if part.depth is not None]
        return StateEstimate(
            first=parts[0].first,
            depth=torch.cat(depth) if depth else None,
            poses=torch.cat([part.poses for part in parts]),
        )

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
            ValueError: nothing was observed yet, or a dream is longer than a chunk.
        """
        if not all(one.observed for one in episodes):
            raise ValueError("a dream needs at least one observed latent; call observe first")
        dreams, frames = noise.shape[1:3]
        histories = [one.history for one in episodes for _ in range(dreams)]
        with self._precision():
            goals = self.model.goal(goal_camera0_m).repeat_interleave(dreams, dim=0)
            context = goals[:, None, None].expand(-1, frames, -1, -1)

            def flow(x: Tensor, flow_time: float) -> Tensor:
                return velocity(self.model, histories, x, flow_time, context)

            rgb = integrate(flow, noise.flatten(0, 1), list(schedule))
            clean = clean_rgb(self.model, histories, rgb)
            states = query_states(self.model, histories, frames, dreamed=clean, context=context)
        found = []
        for number, episode in enumerate(episodes):
            own = slice(number * dreams, (number + 1) * dreams)
            depth = None if states.depth is None else states.depth[own]
            found.append(Dream(first=episode.observed, rgb=rgb[own], depth=depth, poses=states.poses[own]))
        return found

    @torch.no_grad()
    def _take_in(
        self, episodes: Sequence[Episode], rgb_NFChw: Tensor, known: Sequence[StateEstimate | None]
    ) -> list[StateEstimate]:
        """Observe latents that lie in one chunk of each episode."""
        histories, frames = [one.history for one in episodes], rgb_NFChw.shape[1]
        for history in histories:
            history.state.forget_from(self._estimated_from(history.rgb.next))
            history.make_room(frames)
        with self._precision():
            clean_rgb(self.model, histories, rgb_NFChw)
            for history in histories:
                history.rgb.keep(frames)
            states = self._estimates(histories) if self._is_slam else self._issued(histories, known, rgb_NFChw.device)
            self._remember(histories, [own or state for own, state in zip(known, states, strict=True)])
        return states

    def _precision(self) -> torch.autocast:
        """Matrix products in the precision of the weights."""
        return autocast(stored_precision(self.model), next(self.model.parameters()).device)

    def _estimated_from(self, latent: int) -> int:
        """The first latent whose states are estimated, again or for the first time, when a latent comes."""
        return chunk_start(latent, self.config.chunk_size) if self._is_slam and self.config.local_backend else latent

    def _latents_at_once(self, episode: Episode) -> int:
        """How many of the next latents may be taken in as one step."""
        first, limit = episode.observed, self.config.cache_latents
        whole = chunk_start(first, self.config.chunk_size) + self.config.chunk_size - first if first else 1
        fits = episode.history.rgb.held + whole <= limit
        return whole if self._is_slam and self.config.local_backend and fits else 1

    def _estimates(self, histories: Sequence[History]) -> list[StateEstimate]:
        found: dict[int, StateEstimate] = {}
        for frames, rows in _alike([one.rgb.next - one.state.next for one in histories]):
            own = [histories[row] for row in rows]
            states = query_states(self.model, own, frames)
            for place, row in enumerate(rows):
                depth = None if states.depth is None else states.depth[place]
                found[row] = StateEstimate(first=own[place].state.next, depth=depth, poses=states.poses[place])
        return [_anchored(found[row]) for row in range(len(histories))]

    def _issued(
        self, histories: Sequence[History], known: Sequence[StateEstimate | None], device: torch.device
    ) -> list[StateEstimate]:
        anchor = identity_poses(1, self.model.config.pose_slots, device=device)
        found = []
        for history, own in zip(histories, known, strict=True):
            number = history.state.next
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
            own = [histories[row] for row in rows]
            for history, state in zip(own, chosen, strict=True):
                _require_next(history, state)
            clean_states(self.model, own, joined)
            for history in own:
                history.state.keep(len(chosen[0].poses))


def _require_next(history: History, state: StateEstimate) -> None:
    wanted, found = (history.state.next, history.rgb.next), (state.first, state.first + len(state.poses))
    if wanted != found:
        raise ValueError(
            f"states of the latents {wanted[0]} to {wanted[1] - 1} are to be remembered, found from {found}"
        )


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
