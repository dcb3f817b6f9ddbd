"""The codecs by name, and the settings that choose one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import INPUT, SPEED, did_you_mean


@dataclass(frozen=True, kw_only=True)
class CodecConfig:
    """Which codec encodes, and how.

    `name`, the content of `weights` and `dtype` decide the latents; the digest in `CodecInfo` covers them. `device` and
    `batch_clips` decide only speed and memory and stand in no digest: results of `dct` do not know them, those of `wan`
    agree across them to the rounding of `dtype`, not to the bit.

    Attributes:
        name: `dct` (built in, no weights) or `wan` (the Wan2.2 VAE; needs the extra `wan`).
        weights: local folder of `wan` in the diffusers layout (config.json and safetensors); empty for `dct`. Not the
            path but the bytes in it count.
        dtype: arithmetic, `float32` or, for `wan`, `bfloat16`.
        device: `cpu`, `cuda`, or `auto`, which takes cuda where there is one; `dct` runs on the CPU.
        batch_clips: clips that `wan` encodes at once.
    """

    name: str = "dct"
    weights: str = field(default="", metadata=INPUT)
    dtype: str = "float32"
    device: str = field(default="auto", metadata=SPEED)
    batch_clips: int = field(default=1, metadata=SPEED)

    def __post_init__(self) -> None:
        if self.batch_clips < 1:
            raise ConfigError(f"codec.batch_clips must be at least 1, found {self.batch_clips}")


def make_codec(config: CodecConfig) -> VideoCodec:
    """Build the codec of a configuration.

    Raises:
        ConfigError: the name is unknown, a setting does not belong to the codec, or its weights cannot be used.
    """
    if config.name not in _MAKERS:
        raise ConfigError(f"codec.name {config.name!r} is not known; {did_you_mean(config.name, _MAKERS)}")
    return _MAKERS[config.name](config)


def _make_dct(config: CodecConfig) -> VideoCodec:
    if config.weights or config.dtype != "float32" or config.device not in ("auto", "cpu"):
        raise ConfigError(
            "codec dct has no weights and computes in float32 on the CPU, found "
            f"weights = {config.weights!r}, dtype = {config.dtype!r}, device = {config.device!r}; drop them or take wan"
        )
    from wsm_data.codecs.dct import DctCodec  # it imports numba: programs that only read settings need not wait

    return DctCodec()


def _make_wan(config: CodecConfig) -> VideoCodec:
    try:
        from wsm_data.codecs.wan import load_wan_codec  # it imports torch and diffusers, which dct does not need
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"codec wan needs the package {error.name}; install the extra: pip install 'wsm[wan]'"
        ) from error
    return load_wan_codec(config.weights, dtype=config.dtype, device=config.device, batch_clips=config.batch_clips)


_MAKERS: Mapping[str, Callable[[CodecConfig], VideoCodec]] = MappingProxyType({"dct": _make_dct, "wan": _make_wan})
