"""The model's SLAM over a clip: RGB latents one after the other, as in use."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from pipelines.evaluating.slam_sequence import Reconstruction, reconstruction
from wsm_data.access.release import Release
from wsm_data.clips.decoded import DecodedVideo
from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.standardise import standardisations
from wsm_data.schema.clip import Clip
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.evaluation.streaming import stream_clip
from wsm_model.inference.session import SessionConfig
from wsm_model.losses.pose import raw_frame_poses
from wsm_model.model_file import load_model


def model_estimator(
    folder: Path, release: Release, codec: VideoCodec
) -> Callable[[Clip, DecodedVideo], Reconstruction]:
    """What estimates poses and depth of a clip from its RGB latents alone; points have its decoded colours.

    Raises:
        ConfigError: there is no model, it was trained on other latents, or it is one without SLAM.
        IntegrityError: its files are damaged.
    """
    standard = latent_standard(release.manifest)
    model, _ = load_model(folder, standard)
    if model.config.variant is not Variant.SLAM:
        raise ConfigError(f"the model in {folder} must estimate states, and it is one without SLAM; name another")
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    model.to(device)
    standardise = standardisations(release.manifest, depth=False)["rgb"]

    def estimate(clip: Clip, decoded: DecodedVideo) -> Reconstruction:
        stored = torch.from_numpy(clip.rgb_latent.astype(np.float32)).to(device)
        streamed = stream_clip(model, standardise.whole(stored, torch.float32), SessionConfig())
        video = codec.decode(standard.raw_depth(streamed.depth.float().cpu().numpy()))
        depth_m = depth_m_from_latent_video(video[list(decoded.frames)], clip.meta.depth_range)
        poses = raw_frame_poses(streamed.poses.float().cpu()).double().numpy()
        return reconstruction(clip, decoded, depth_m, poses, None)

    return estimate
