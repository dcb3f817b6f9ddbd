"""The codec that decodes a release."""

from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.registry import CodecConfig, make_codec
from wsm_data.errors import ConfigError
from wsm_data.shards.manifest import ReleaseManifest


def codec_of(manifest: ReleaseManifest, weights: str = "") -> VideoCodec:
    """Build the codec a release was encoded with.

    Args:
        manifest: the release.
        weights: local folder of the codec's weights; empty for a codec without.

    Raises:
        ConfigError: the codec cannot be built, or is not the one of the release.
    """
    codec = make_codec(CodecConfig(name=manifest.codec.name, dtype=manifest.codec.dtype, weights=weights))
    if codec.describe().digest != manifest.codec.digest:
        raise ConfigError(
            f"release {manifest.name} was encoded with codec {manifest.codec.name} {manifest.codec.digest[:12]}, these "
            f"weights are {codec.describe().digest[:12]}; give the folder of the weights that were used"
        )
    return codec
