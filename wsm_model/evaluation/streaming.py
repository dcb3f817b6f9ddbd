"""A clip as a model meets it in use: latent by latent, with a dream on the way.

Shape suffixes: F latents, M pose slots, C channels, h rows and w columns of a latent.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from wsm_model.config import Variant
from wsm_model.inference.session import Dream, Episode, Session, SessionConfig, StateEstimate
from wsm_model.model import WorldSlamModel

_SEEN_SHARE = 0.5
"""Share of a clip that is seen before a dream begins."""


@dataclass(frozen=True, kw_only=True)
class DreamRequest:
    """A dream to be had on the way.

    Attributes:
        after: latents that are seen before it.
        goal_camera0_m: goal in the first camera's frame [3], m.
        noise: where its flow starts, [F, C, h, w].
        schedule: flow times, from 1 to 0.
    """

    after: int
    goal_camera0_m: Tensor
    noise: Tensor
    schedule: list[float]


@dataclass(frozen=True, kw_only=True)
class StreamedClip:
    """What a model made of a clip.

    Attributes:
        depth: standardised depth latents [F, C, h, w], each as it was last estimated; zero without SLAM.
        poses: [F, M, 7] likewise; without SLAM those that were issued.
        dream: what was asked for.
    """

    depth: Tensor
    poses: Tensor
    dream: Dream | None


def dream_bounds(length: int, chunk: int) -> tuple[int, int]:
    """First latent and end of the dream in a clip of `length` latents: a chunk after its first half."""
    seen = max(1, min(length - chunk, int(length * _SEEN_SHARE)))
    return seen, min(length, seen + chunk)


@torch.no_grad()
def stream_clip(
    model: WorldSlamModel,
    rgb_FChw: Tensor,
    config: SessionConfig,
    *,
    issued_FM7: Tensor | None = None,
    request: DreamRequest | None = None,
) -> StreamedClip:
    """Let a model observe a clip, on its own earlier estimates.

    Args:
        model: in evaluation mode.
        rgb_FChw: standardised RGB latents of the clip.
        config: chunk size, cache and backend.
        issued_FM7: poses of the clip; a model without SLAM estimates none and must be told them, another is not.
        request: the dream to be had.
    """
    session = Session(model, config)
    episode = session.start()
    issued = None if model.config.variant is Variant.SLAM else issued_FM7
    depth, dream = torch.zeros_like(rgb_FChw), None
    poses = torch.zeros(len(rgb_FChw), model.config.pose_slots, 7, device=rgb_FChw.device)
    after = len(rgb_FChw) if request is None else request.after
    for part in (slice(0, after), slice(after, len(rgb_FChw))):
        for states in _observe(session, episode, rgb_FChw[part], issued):
            window = slice(states.first, states.first + len(states.poses))
            poses[window] = states.poses
            if states.depth is not None:
                depth[window] = states.depth
        if request is not None and part.start == 0:
            noise, goal = request.noise[None, None], request.goal_camera0_m[None]
            (dream,) = session.dream([episode], goal, noise, request.schedule)
    return StreamedClip(depth=depth, poses=poses, dream=dream)


def _observe(
    session: Session, episode: Episode, rgb_FChw: Tensor, issued_FM7: Tensor | None
) -> Iterator[StateEstimate]:
    """The next latents: as many at once as the backend allows, or one by one with their poses."""
    if issued_FM7 is None:
        if len(rgb_FChw):
            yield session.observe_all(episode, rgb_FChw)
        return
    for latent in rgb_FChw:
        first = episode.observed
        known = StateEstimate(first=first, depth=None, poses=issued_FM7[first : first + 1].float())
        yield from session.observe([episode], latent[None], [known])
