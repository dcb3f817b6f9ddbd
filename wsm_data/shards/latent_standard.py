"""The standard of a release's latents, from its manifest."""

import numpy as np

from wsm_data.errors import ConfigError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.manifest import ReleaseManifest


def latent_standard(manifest: ReleaseManifest) -> LatentStandard:
    """How latents of a release are standardised.

    Depth by the statistics of the release; empty where no clip has depth. Colour by those of its codec, or by those of
    the release where the codec has none of its own. How far channels are evened out is the codec's to say.

    Raises:
        ConfigError: the release has no statistics, for want of training clips.
    """
    codec, rgb, depth = manifest.codec, manifest.rgb_statistics, manifest.depth_statistics
    if not rgb.mean:
        raise ConfigError(
            f"the release {manifest.name} must have latent statistics to standardise by, but it has no training clips "
            "to measure them on; set standardise = false, or name a release with a split `train` first"
        )
    return LatentStandard(
        codec=codec.name,
        codec_digest=codec.digest,
        rgb_mean=codec.latent_mean or rgb.mean,
        rgb_std=channel_scales(codec.latent_std or rgb.std, codec.whitening),
        depth_mean=depth.mean,
        depth_std=channel_scales(depth.std, codec.whitening),
    )


def channel_scales(std: tuple[float, ...], whitening: float) -> tuple[float, ...]:
    """What channels are divided by: std^w, times one factor that makes their mean variance 1.

    Args:
        std: standard deviation of each channel.
        whitening: w. With 1 every channel has variance 1 (the paper); with 0 all share one scale and keep their shares
            of the energy; between, variances are in proportion to std^(2 - 2 w).
    """
    if whitening == 1.0 or not std:
        return std
    deviation = np.array(std, np.float64)
    scales = deviation**whitening
    return tuple((scales * np.sqrt(np.square(deviation / scales).mean())).tolist())
