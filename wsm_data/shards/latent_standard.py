"""The standard of a release's latents, from its manifest."""

from wsm_data.errors import ConfigError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.manifest import ReleaseManifest


def latent_standard(manifest: ReleaseManifest) -> LatentStandard:
    """How latents of a release are standardised.

    Depth by the statistics of the release; empty where no clip has depth. Colour by those of its codec, or by those of
    the release where the codec has none of its own.

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
        rgb_std=codec.latent_std or rgb.std,
        depth_mean=depth.mean,
        depth_std=depth.std,
    )
