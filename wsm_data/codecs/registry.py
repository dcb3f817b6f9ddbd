"""The codecs by name, and the settings that choose one."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import MappingProxyType

from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import ConfigError
from wsm_data.files.typed_toml import INPUT, SPEED, did_you_mean
from wsm_data.schema.codec import CodecInfo


@dataclass(frozen=True, kw_only=True)
class CodecConfig:
    """Which codec encodes, and how.

    `name`, the content of `weights` and `dtype` decide the latents; the digest in `CodecInfo` covers them. `device` and
    `batch_clips` stand in no digest: results of `dct` do not know them, those of `wan` agree across them to the
    rounding of `dtype`, not to the bit.

    Attributes:
        name: `dct` (built in, no weights) or `wan` (the Wan2.2 VAE; needs the extra `wan`).
        weights: local folder of `wan` in the diffusers layout (config.json and safetensors); empty for `dct`. Not the
            path but the bytes in it count.
        dtype: arithmetic, `float32` or, for `wan`, `bfloat16`.
        device: `cpu`, `cuda`, or `auto`, which takes cuda where there is one; `dct` runs on the CPU.
        batch_clips: clips whose colour and depth videos `wan` encodes at once. With 1 a batch is the two equally long
            videos of one clip, and its bytes depend on that clip alone. With more, clips that were waiting together
            share a batch: a GPU is better used, but latents then agree to the rounding of `dtype` only, and depend on
            which clips were pending, so a resumed run need not give the bytes of an undisturbed one. A setting.
    """

    name: str = "dct"
    weights: str = field(default="", metadata=INPUT)
    dtype: str = "float32"
    device: str = field(default="auto", metadata=SPEED)
    batch_clips: int = 1

    def __post_init__(self) -> None:
        if self.batch_clips < 1:
            raise ValueError(f"batch_clips must be at least 1, found {self.batch_clips}")


def make_codec(config: CodecConfig) -> VideoCodec:
    """Build the codec of a configuration.

    Raises:
        ConfigError: the name is unknown, a setting does not belong to the codec, or its weights cannot be used.
    """
    return _codec_kind(config).make(config)


def describe_codec(config: CodecConfig) -> CodecInfo:
    """What the codec of a configuration says of itself; weights are hashed, but no network is built.

    Raises:
        ConfigError: as `make_codec`, except that the tensors in the weights are not looked at.
    """
    return _codec_kind(config).describe(config)


@dataclass(frozen=True, kw_only=True)
class _CodecKind:
    make: Callable[[CodecConfig], VideoCodec]
    describe: Callable[[CodecConfig], CodecInfo]


def _codec_kind(config: CodecConfig) -> _CodecKind:
    if config.name not in _CODECS:
        raise ConfigError(f"codec.name {config.name!r} is not known; {did_you_mean(config.name, _CODECS)}")
    return _CODECS[config.name]


def _make_dct(config: CodecConfig) -> VideoCodec:
    if config.weights or config.dtype != "float32" or config.device not in ("auto", "cpu"):
        raise ConfigError(
            "codec dct has no weights and computes in float32 on the CPU, found "
            f"weights = {config.weights!r}, dtype = {config.dtype!r}, device = {config.device!r}; drop them or take wan"
        )
    from wsm_data.codecs.dct import DctCodec  # it imports numba: programs that only read settings need not wait

    return DctCodec()


def _describe_dct(config: CodecConfig) -> CodecInfo:
    return _make_dct(config).describe()


def _make_wan(config: CodecConfig) -> VideoCodec:
    with _extra_named():
        from wsm_data.codecs.wan import load_wan_codec  # it imports torch and diffusers, which dct does not need
    return load_wan_codec(config.weights, dtype=config.dtype, device=config.device, batch_videos=2 * config.batch_clips)


def _describe_wan(config: CodecConfig) -> CodecInfo:
    with _extra_named():
        from wsm_data.codecs.wan import describe_wan_codec
    return describe_wan_codec(config.weights, dtype=config.dtype, device=config.device)


@contextmanager
def _extra_named() -> Iterator[None]:
    """Turn a package that is not there into the extra that brings it."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"codec wan needs the package {error.name}; install the extra: pip install 'wsm[wan]'"
        ) from error


_CODECS: Mapping[str, _CodecKind] = MappingProxyType(
    {
        "dct": _CodecKind(make=_make_dct, describe=_describe_dct),
        "wan": _CodecKind(make=_make_wan, describe=_describe_wan),
    }
)
