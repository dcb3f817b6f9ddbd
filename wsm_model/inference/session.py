"""One episode: observe a latent at a time, keep the states of the current chunk up to date, dream ahead (paper, 3.4).

Shape suffixes: B batch, F frames, M pose slots, C channels, h rows and w columns of a latent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from wsm_data.schema.sequence import chunk_start
from wsm_model.config import Variant
from wsm_model.inference.cache import FrameCache
from wsm_model.inference.passes import History, StateEstimate, query_states, velocity, write_rgb, write_states
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


@dataclass(frozen=True, kw_only=True)
class Dream:
    """What the model expects to see, and where it would be.

    Attributes:
        rgb: standardised RGB latents [B, F, C, h, w].
        states: their depth and poses.
    """

    rgb: Tensor
    states: StateEstimate


class Session:
    """The history of an episode under one model.

    Args:
        model: in evaluation mode.
        config: chunk size and cache.

    Attributes:
        observed: latents observed so far.
    """

    def __init__(self, model: WorldSlamModel, config: SessionConfig):
        self.model = model
        self.config = config
        self.observed = 0
        self._idm = model.config.variant is Variant.IDM
        # A dream stands in the RGB cache for a moment, beside all that was observed.
        self._history = History(
            rgb=FrameCache(model.config.layers, config.cache_latents + config.chunk_size),
            state=FrameCache(model.config.layers, config.cache_latents),
        )

    @torch.no_grad()
    def observe(self, rgb: Tensor, known: StateEstimate | None = None) -> StateEstimate:
        """Take in the next latent and estimate the states of the current chunk.

        Args:
            rgb: standardised RGB latent [B, C, h, w].
            known: states to remember in place of the estimates, as in teacher forcing. Without SLAM nothing is
                estimated, and these are the poses issued before; the anchor's are the identity.

        Returns:
            States of the current chunk up to this latent; of this latent alone without the local backend.

        Raises:
            ValueError: without SLAM, a latent after the anchor has no known poses.
        """
        number = self.observed
        self._make_room()
        write_rgb(self.model, self._history, rgb.unsqueeze(1), number)
        self.observed += 1
        states = self._issued(number, rgb, known) if self._idm else self._estimate(number, len(rgb))
        write_states(self.model, self._history, known or states)
        return states

    @torch.no_grad()
    def dream(self, goal_camera0_m: Tensor, noise: Tensor, schedule: Sequence[float]) -> Dream:
        """Dream a chunk after what was observed, and estimate its states; the history stays as it is.

        Args:
            goal_camera0_m: goals in the first camera's frame [B, 3], m.
            noise: where the flow starts, [B, K, C, h, w].
            schedule: flow times, from 1 to 0.

        Raises:
            ValueError: nothing was observed yet.
        """
        if not self.observed:
            raise ValueError("a dream needs at least one observed latent; call observe first")
        first, frames = self.observed, noise.shape[1]
        context = self.model.goal(goal_camera0_m)[:, None, None].expand(-1, frames, -1, -1)

        def flow(x: Tensor, flow_time: float) -> Tensor:
            return velocity(self.model, self._history, x, flow_time, first, context)

        dreamed = integrate(flow, noise, list(schedule))
        write_rgb(self.model, self._history, dreamed, first)
        states = query_states(self.model, self._history, first, frames, len(noise), context)
        self._history.rgb.forget_from(first)
        return Dream(rgb=dreamed, states=states)

    def _estimate(self, number: int, rows: int) -> StateEstimate:
        first = self._chunk_start(number) if self.config.local_backend else number
        return query_states(self.model, self._history, first, self.observed - first, rows)

    def _issued(self, number: int, rgb: Tensor, known: StateEstimate | None) -> StateEstimate:
        if known is None and number:
            raise ValueError(
                f"latent {number} needs the poses that were issued for it: without SLAM none are estimated"
            )
        slots = self.model.config.pose_slots
        return known or StateEstimate(first=0, depth=None, poses=identity_poses(len(rgb), 1, slots, device=rgb.device))

    def _chunk_start(self, number: int) -> int:
        """First latent of the chunk of a latent; the anchor is a chunk of its own."""
        return chunk_start(number, self.config.chunk_size)

    def _make_room(self) -> None:
        if self._history.state.held == self.config.cache_latents:
            self._history.rgb.drop_oldest()
            self._history.state.drop_oldest()
