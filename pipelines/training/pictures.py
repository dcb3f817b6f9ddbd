"""Pictures of a training run: its curves, and what the model makes of a held-out clip."""

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from pipelines.training.config import HeldOutConfig
from wsm_data.files.jsonlines import read_lines
from wsm_data.loaders.batches.batch import Batch
from wsm_data.schema.sequence import frames_of
from wsm_data.view.clip.pictures import spread_frames
from wsm_data.view.training.curves import draw_training_curves
from wsm_data.view.training.dream_sheet import DreamSheet, draw_dream_sheet
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.streaming import DreamRequest, dream_bounds, stream_clip
from wsm_model.inference.sampler import flow_schedule
from wsm_model.losses.pose import raw_frame_poses
from wsm_model.model import WorldSlamModel

CURVE_UNITS = {
    "loss": "weighted sum (1)",
    "flow": "squared velocity error (1)",
    "depth": "squared latent error (1)",
    "pose_absolute": "smooth L1 (m and 1)",
    "pose_relative": "smooth L1 (m and 1)",
    "learning_rate": "base learning rate (1)",
    "held_out_depth_abs_rel": "mean relative depth error (1)",
    "held_out_depth_delta1": "share of pixels within 1.25 (1)",
    "held_out_ate_rmse_unaligned_m": "camera error, not aligned (m)",
    "held_out_dream_psnr_db_1": "PSNR of a dream at +1 latent (dB)",
    "held_out_dream_psnr_db_4": "PSNR of a dream at +4 latents (dB)",
}
_FRAMES_SHOWN = 5


@dataclass(frozen=True, kw_only=True)
class DreamedClip:
    """The beginning of a clip as it was seen, and a dream behind it; latents are standardised.

    Attributes:
        seen: latents that were seen.
        end: latents that were seen and dreamed, F.
        rgb: true latents, then dreamed ones, [F, C, h, w].
        depth: estimated, [F, C, h, w]; None without SLAM.
        poses: estimated, [F, M, 7]; without SLAM the true ones of what was seen.
    """

    seen: int
    end: int
    rgb: Tensor
    depth: Tensor | None
    poses: Tensor


def draw_curves(run: Path) -> None:
    """Write curves.png of a run's metrics."""
    records = list(read_lines(run / "metrics.jsonl"))
    if records:
        draw_training_curves(records, CURVE_UNITS, run / "curves.png")


def draw_dream(
    model: WorldSlamModel,
    batch: Batch,
    decoding: Decoding,
    config: HeldOutConfig,
    path: Path | None,
    *,
    shift: float,
    title: str,
) -> None:
    """See the first half of a clip, dream a chunk, and draw both beside the truth.

    Without SLAM the true poses of what is seen are given, and there is no depth to draw.

    Args:
        model: any number of ranks may call this with the same clip.
        batch: one clip.
        decoding: of its release.
        config: chunk size and sampler steps.
        path: where the PNG goes; None on ranks that only take part.
        shift: gamma of the flow time.
        title: of the sheet.
    """
    dreamed = dream_clip(model, batch, config, shift=shift)
    if path is not None:
        _draw(path, batch, decoding, title, dreamed)


def dream_clip(model: WorldSlamModel, batch: Batch, config: HeldOutConfig, *, shift: float) -> DreamedClip:
    """Let a model see the first half of a clip and dream a chunk; arguments as in `draw_dream`.

    Raises:
        ValueError: the model gave no dream.
    """
    rgb = batch.rgb[0].float()
    seen, end = dream_bounds(batch.spans[0].length, config.session.chunk_size)
    noise = torch.randn(end - seen, *rgb.shape[1:], generator=torch.Generator().manual_seed(0)).to(rgb.device)
    request = DreamRequest(
        after=seen,
        goal_camera0_m=batch.goal_camera0_m[0].float(),
        noise=noise,
        schedule=flow_schedule(config.flow_steps, shift),
    )
    streamed = stream_clip(model, rgb[:seen], config.session, issued_FM7=batch.poses[0, :seen].float(), request=request)
    dream = streamed.dream
    if dream is None:
        raise ValueError("a dream that was asked for must be there, and there is none")
    return DreamedClip(
        seen=seen,
        end=end,
        rgb=torch.cat([rgb[:seen], dream.rgb[0]]),
        depth=None if dream.depth is None else torch.cat([streamed.depth, dream.depth[0]]),
        poses=torch.cat([streamed.poses, dream.poses[0]]),
    )


def _draw(path: Path, batch: Batch, decoding: Decoding, title: str, dreamed: DreamedClip) -> None:
    seen, end, depth = dreamed.seen, dreamed.end, dreamed.depth
    true_rgb = batch.rgb[0, :end].float()
    first = frames_of(seen)  # the first raw frame of the dream
    dreamed_frames = frames_of(end) - first
    frames = [first + one for one in spread_frames(dreamed_frames, _FRAMES_SHOWN)]
    true_m, estimated_m = (
        raw_frame_poses(slots.float())[:, :3].double().cpu().numpy() for slots in (batch.poses[0, :end], dreamed.poses)
    )
    sheet = DreamSheet(
        title=f"{title}: {batch.keys[0]}, {first} frames seen, {dreamed_frames} dreamed",
        frames=tuple(frames),
        true_rgb_u8=decoding.rgb_u8(true_rgb)[frames],
        dreamed_rgb_u8=decoding.rgb_u8(dreamed.rgb)[frames],
        true_depth_m=None if batch.depth is None else decoding.depth_m(batch.depth[0, :end])[frames],
        estimated_depth_m=None if depth is None else decoding.depth_m(depth)[frames],
        depth_range=decoding.depth_range,
        true_path_m=true_m,
        estimated_path_m=estimated_m[:first],
        dreamed_path_m=estimated_m[first - 1 :],
    )
    draw_dream_sheet(sheet, path)
