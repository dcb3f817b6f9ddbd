"""How well a model estimates states and dreams on clips it was not trained on, beside what knows nothing.

States are estimated as in use: one latent after the other through the cache, on the model's own earlier estimates. The
truth is what the clip's own latents decode to: a release keeps no other, and what the codec loses no model can know.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_data.errors import DataError
from wsm_data.metrics.depth import DepthErrors, depth_errors
from wsm_data.metrics.images import ssim
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m, ate_sim3
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array
from wsm_data.schema.batch import ClipBatch
from wsm_data.schema.sequence import TEMPORAL_RATIO
from wsm_model.batches import noise_stream
from wsm_model.config import Variant
from wsm_model.evaluation.baselines import Baselines, counted_depth, recorded_frames, true_depth
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.streaming import DreamRequest, StreamedClip, dream_bounds, stream_clip
from wsm_model.evaluation.trajectory import constant_velocity, zero_motion
from wsm_model.inference.session import SessionConfig
from wsm_model.losses.pose import raw_frame_poses
from wsm_model.model import WorldSlamModel


@dataclass(frozen=True, kw_only=True)
class HeldOutSettings:
    """How clips are measured.

    Attributes:
        session: chunk size, cache and backend of the streaming estimation.
        schedule: flow times of a dream, from 1 to 0.
        decoding: of the release.
        baselines: fitted to all clips that are measured.
    """

    session: SessionConfig
    schedule: list[float]
    decoding: Decoding
    baselines: Baselines


@dataclass(frozen=True, kw_only=True)
class StateErrors:
    """Errors of the states of one clip; still frames that were added do not count.

    Attributes:
        ate_rmse_unaligned_m: camera centres as they are, m.
        ate_rmse_sim3_m: after Sim(3) alignment; None where the true centres lie on one line, and none is defined.
        ate_rmse_zero_motion_m: of a camera that stays.
        ate_rmse_constant_velocity_m: of a camera that goes on as it truly began.
        depth_mse: of standardised depth latents.
        mean_depth_mse: of predicting the training mean.
        depth: of decoded pixels, in metres; None where no cell of the clip was measured well enough to count.
        constant_map: of the best constant depth map; None likewise.
    """

    ate_rmse_unaligned_m: float
    ate_rmse_sim3_m: float | None
    ate_rmse_zero_motion_m: float
    ate_rmse_constant_velocity_m: float
    depth_mse: float
    mean_depth_mse: float
    depth: DepthErrors | None
    constant_map: DepthErrors | None


@dataclass(frozen=True, kw_only=True)
class PictureErrors:
    """Errors of decoded frames, one number for each latent of the chunk: +1, +2, ...

    Attributes:
        mse: mean squared error of colours in [-1, 1].
        ssim: structural similarity.
    """

    mse: tuple[float, ...]
    ssim: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class DreamErrors:
    """Errors of one dream after the first half of a clip, and of two guesses in its place.

    Attributes:
        dream: of the model.
        copy: of the last latent that was seen, repeated.
        shrunk_copy: of the best linear guess from it, channel by channel.
    """

    dream: PictureErrors
    copy: PictureErrors
    shrunk_copy: PictureErrors


@dataclass(frozen=True, kw_only=True)
class ClipErrors:
    """Errors on one clip.

    Attributes:
        key: of the clip.
        states: None without SLAM: a model that estimates no states of what it sees.
        dream: None where a clip is too short to have any.
    """

    key: str
    states: StateErrors | None
    dream: DreamErrors | None


def clip_errors(model: WorldSlamModel, batch: ClipBatch[Tensor], settings: HeldOutSettings) -> list[ClipErrors]:
    """Errors of every clip of a batch. A model without SLAM is told the true poses of what it sees."""
    found = []
    for number, span in enumerate(batch.spans):
        rgb = batch.rgb[span.place].float()
        request = _request(batch, number, settings)
        streamed = stream_clip(
            model, rgb, settings.session, issued_FM7=batch.poses[span.place].float(), request=request
        )
        has_states = model.config.variant is Variant.SLAM
        found.append(
            ClipErrors(
                key=batch.keys[number],
                states=_state_errors(streamed, batch, number, settings) if has_states else None,
                dream=_dream_errors(streamed, rgb, settings),
            )
        )
    return found


def _request(batch: ClipBatch[Tensor], number: int, settings: HeldOutSettings) -> DreamRequest | None:
    span = batch.spans[number]
    seen, end = dream_bounds(span.length, settings.session.chunk_size)
    if seen == end:
        return None
    stream = noise_stream(0, batch.epoch, batch.step, int(batch.refs[number]))
    noise = torch.randn(end - seen, *batch.rgb.shape[2:], generator=stream).to(batch.rgb.device)
    goal = batch.goal_camera0_m[number].float()
    return DreamRequest(after=seen, goal_camera0_m=goal, noise=noise, schedule=settings.schedule)


def _state_errors(
    streamed: StreamedClip, batch: ClipBatch[Tensor], number: int, settings: HeldOutSettings
) -> StateErrors:
    place = batch.spans[number].place
    recorded = recorded_frames(batch, number)
    estimated, true = (
        raw_frame_poses(slots.float().cpu())[:, :3].double().numpy()[recorded]
        for slots in (streamed.poses, batch.poses[place])
    )
    latents = true_depth(batch, number)
    counts = counted_depth(batch, number, settings.decoding)
    depth, constant_map = _depth_errors(streamed.depth, latents, counts, settings) if counts.any() else (None, None)
    return StateErrors(
        ate_rmse_unaligned_m=ate_rmse_unaligned_m(estimated, true),
        ate_rmse_sim3_m=_ate_rmse_sim3_m(estimated, true),
        ate_rmse_zero_motion_m=ate_rmse_unaligned_m(zero_motion(true), true),
        ate_rmse_constant_velocity_m=ate_rmse_unaligned_m(constant_velocity(true), true),
        depth_mse=float((streamed.depth - latents).square().mean()),
        mean_depth_mse=float(latents.square().mean()),
        depth=depth,
        constant_map=constant_map,
    )


def _depth_errors(
    estimated: Tensor, true: Tensor, counts: BoolArray, settings: HeldOutSettings
) -> tuple[DepthErrors, DepthErrors]:
    """Of the estimated latents [F, C, h, w], and of the constant map."""
    true_m = settings.decoding.depth_m(true)
    if settings.baselines.depth_map_m is None:
        raise ValueError("errors of depth need a constant depth map beside them, and the clips it is of had no depth")
    constant_m = np.broadcast_to(settings.baselines.depth_map_m, true_m.shape)
    found = depth_errors(settings.decoding.depth_m(estimated), true_m, counts)
    return found, depth_errors(constant_m, true_m, counts)


def _ate_rmse_sim3_m(estimated: Float64Array, true: Float64Array) -> float | None:
    try:
        return ate_sim3(estimated, true).rmse_m
    except DataError:
        return None


def _dream_errors(streamed: StreamedClip, rgb: Tensor, settings: HeldOutSettings) -> DreamErrors | None:
    if streamed.dream is None:
        return None
    first, dreamed = streamed.dream.first, streamed.dream.rgb[0]
    last, end = rgb[first - 1], first + len(dreamed)
    shrink = settings.baselines.shrink[: len(dreamed), :, None, None].to(last)

    def video(latents: Tensor) -> Float32Array:
        return settings.decoding.rgb(torch.cat([last[None], latents]))[1:]

    true = video(rgb[first:end])
    return DreamErrors(
        dream=_picture_errors(video(dreamed), true),
        copy=_picture_errors(video(last.expand_as(dreamed)), true),
        shrunk_copy=_picture_errors(video(shrink * last), true),
    )


def _picture_errors(video: Float32Array, true: Float32Array) -> PictureErrors:
    latents = list(zip(*(frames.reshape(-1, TEMPORAL_RATIO, *true.shape[1:]) for frames in (video, true)), strict=True))
    return PictureErrors(
        mse=tuple(float(np.square(one.astype(np.float64) - other).mean()) for one, other in latents),
        ssim=tuple(ssim(other, one) for one, other in latents),
    )
