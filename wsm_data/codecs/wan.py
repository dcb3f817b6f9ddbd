"""The Wan2.2 VAE through diffusers, from a folder on this machine. The only module of the library's codecs with torch.

The folder is the `vae` folder of the published diffusers layout: config.json and safetensors, one file or several with
their index. Nothing is fetched and nothing is unpickled.
"""

import inspect
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import torch
from diffusers import AutoencoderKLWan
from diffusers.models.autoencoders.autoencoder_kl_wan import WanCausalConv3d, patchify
from safetensors import SafetensorError
from safetensors.torch import load_file

from wsm_data.codecs.base import EncoderState, require_latents, require_next_frames, require_video
from wsm_data.codecs.clip_video import pad_frames
from wsm_data.errors import ConfigError
from wsm_data.files.digest import digest_json, sha256_file
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.codec import CodecInfo

GEOMETRY: Mapping[str, object] = MappingProxyType(
    {
        "z_dim": 48,
        "dim_mult": [1, 2, 4, 4],
        "num_res_blocks": 2,
        "attn_scales": [],
        "temperal_downsample": [False, True, True],  # upstream's spelling
        "is_residual": True,
        "in_channels": 12,
        "out_channels": 12,
        "patch_size": 2,
        "scale_factor_spatial": 16,
        "scale_factor_temporal": 4,
    }
)
"""What config.json must say. The widths base_dim (160) and decoder_base_dim (256) do not change the geometry."""

_DTYPES = MappingProxyType({"float32": torch.float32, "bfloat16": torch.bfloat16})
_CONFIG_FILE = "config.json"
_WEIGHTS_FILE = "diffusion_pytorch_model.safetensors"
_INDEX_FILE = "diffusion_pytorch_model.safetensors.index.json"


@dataclass(frozen=True, kw_only=True, eq=False)
class WanEncoderState:
    """Implements `EncoderState`: what each causal convolution must see of the frames before, on the network's device.

    Attributes:
        latents: latents encoded so far.
        features: last frames that went into each convolution, in the order of the network; None where none are kept.
    """

    latents: int
    features: tuple[torch.Tensor | None, ...]

    def arrays(self) -> dict[str, np.ndarray]:
        """See `EncoderState.arrays`; float32, which holds bfloat16 exactly."""
        kept = {
            f"feature_{number:03d}": feature.float().cpu().numpy()
            for number, feature in enumerate(self.features)
            if feature is not None
        }
        return {"latents": np.array(self.latents), "features": np.array(len(self.features)), **kept}


@dataclass(frozen=True, eq=False)
class WanCodec:
    """Implements `VideoCodec` with a loaded VAE; made by `load_wan_codec`.

    Attributes:
        vae: the network, in evaluation mode, on its device and in its dtype.
        info: geometry and identity.
        batch_videos: videos encoded at once.
    """

    vae: AutoencoderKLWan
    info: CodecInfo
    batch_videos: int = 1

    def encode(self, video: Float32Array) -> Float32Array:
        """See `VideoCodec.encode`: the mode of the posterior, never a sample."""
        return self.encode_many([video])[0]

    def encode_many(self, videos: Sequence[Float32Array]) -> list[Float32Array]:
        """See `VideoCodec.encode_many`. Similar lengths share a batch; results stand in the order of `videos`.

        Shorter videos are padded with repeats of their last frame and their latents cropped again: the encoder is
        causal, so what follows a video does not reach it. Kernels may round differently in batches of another size or
        length, so across batches latents agree to the rounding of the dtype, not to the bit. Equally long videos that
        follow one another stay together, so with `batch_videos` = 2 and pairs of videos every batch is a pair.

        Raises:
            ValueError: a length is not 1 + 4k, a side not a multiple of 32, or the sizes differ.
        """
        for video in videos:
            require_video(video)
        if len({video.shape[1:] for video in videos}) > 1:
            raise ValueError(f"videos of one call must have one size, found {[video.shape[1:3] for video in videos]}")
        longest_first = sorted(range(len(videos)), key=lambda i: -len(videos[i]))
        latents: dict[int, Float32Array] = {}
        for start in range(0, len(videos), self.batch_videos):
            members = longest_first[start : start + self.batch_videos]
            batch = self._encode_batch([videos[i] for i in members])
            for i, encoded in zip(members, batch, strict=True):
                latents[i] = encoded[: 1 + (len(videos[i]) - 1) // self.info.temporal_ratio]
        return [latents[i] for i in range(len(videos))]

    def _encode_batch(self, videos: Sequence[Float32Array]) -> Float32Array:
        """Latents [N, F, C, h, w] of N videos, padded to the longest."""
        longest = max(len(video) for video in videos)
        padded = np.stack([pad_frames(video, longest) for video in videos])
        with torch.inference_mode():
            x = torch.from_numpy(padded).to(self.vae.device, self.vae.dtype).permute(0, 4, 1, 2, 3).contiguous()
            mode = self.vae.encode(x).latent_dist.mode()
        return np.ascontiguousarray(mode.permute(0, 2, 1, 3, 4).float().cpu().numpy())

    def encode_next(self, frames: Float32Array, state: EncoderState | None = None) -> tuple[Float32Array, EncoderState]:
        """See `VideoCodec.encode_next`; agrees with `encode` to the rounding of the dtype.

        These are the steps that `AutoencoderKLWan.encode` takes inside, with the features between them in the state.
        """
        if state is not None and not isinstance(state, WanEncoderState):
            raise ValueError(f"a state of the codec wan must be given, found {type(state).__name__}")
        done = state.latents if state else 0
        require_next_frames(frames, done)
        features = list(state.features) if state else [None] * _convolutions(self.vae)
        with torch.inference_mode():
            x = torch.from_numpy(frames).to(self.vae.device, self.vae.dtype).permute(3, 0, 1, 2)[None].contiguous()
            x = patchify(x, patch_size=self.vae.config.patch_size)
            if features[0] is not None and features[0].shape[-2:] != x.shape[-2:]:
                raise ValueError(f"frames of a video must have one size, found {frames.shape[1:3]} after another")
            moments = self.vae.quant_conv(self.vae.encoder(x, feat_cache=features, feat_idx=[0]))
            mode = moments.chunk(2, dim=1)[0][0, :, 0]
        latent = np.ascontiguousarray(mode.float().cpu().numpy())
        return latent, WanEncoderState(latents=done + 1, features=tuple(features))

    def restored(self, arrays: Mapping[str, np.ndarray]) -> EncoderState:
        """See `VideoCodec.restored`."""
        stored = [arrays.get(f"feature_{number:03d}") for number in range(int(arrays["features"]))]
        features = [
            None if one is None else torch.from_numpy(one).to(self.vae.device, self.vae.dtype) for one in stored
        ]
        return WanEncoderState(latents=int(arrays["latents"]), features=tuple(features))

    def decode(self, latents: Float32Array) -> Float32Array:
        """See `VideoCodec.decode`."""
        require_latents(latents, self.info.channels)
        with torch.inference_mode():
            z = torch.from_numpy(latents).to(self.vae.device, self.vae.dtype)
            video = self.vae.decode(z.permute(1, 0, 2, 3)[None].contiguous()).sample[0]
        return np.ascontiguousarray(video.permute(1, 2, 3, 0).float().clamp(-1, 1).cpu().numpy())

    def describe(self) -> CodecInfo:
        """See `VideoCodec.describe`."""
        return self.info


def load_wan_codec(weights: str, *, dtype: str = "float32", device: str = "auto", batch_videos: int = 1) -> WanCodec:
    """Load the VAE from a local folder.

    Args:
        weights: folder with config.json and the safetensors.
        dtype: `float32` or `bfloat16`, for preparation and inference alike.
        device: `cpu`, `cuda`, or `auto`.
        batch_videos: videos encoded at once.

    Raises:
        ConfigError: the folder lacks files, the geometry or the tensors are not those of the Wan2.2 VAE, or dtype or
            device are not to be had.
    """
    on = _pick_device(device)
    folder = _weights_folder(weights, dtype)
    config, files = _read_config(folder), _weight_files(folder)
    with torch.device("meta"):  # no memory and no random numbers for tensors that are replaced at once
        vae = AutoencoderKLWan(**config)
    _load_tensors(vae, files, folder)
    vae.to(on, _DTYPES[dtype]).eval().requires_grad_(False)
    return WanCodec(vae=vae, info=_describe(config, files, dtype), batch_videos=batch_videos)


def describe_wan_codec(weights: str, *, dtype: str = "float32", device: str = "auto") -> CodecInfo:
    """What `load_wan_codec` would say of itself, without building the network: files are hashed, not loaded.

    Raises:
        ConfigError: as `load_wan_codec`, except that the tensors are not looked at.
    """
    _pick_device(device)
    folder = _weights_folder(weights, dtype)
    return _describe(_read_config(folder), _weight_files(folder), dtype)


def _weights_folder(weights: str, dtype: str) -> Path:
    if dtype not in _DTYPES:
        raise ConfigError(f"codec.dtype of wan must be one of {', '.join(_DTYPES)}, found {dtype!r}")
    if not weights:
        raise ConfigError("codec wan needs codec.weights, the local folder of the Wan2.2 VAE in the diffusers layout")
    return Path(weights)


def _read_config(folder: Path) -> dict[str, Any]:
    """The constructor's arguments from config.json; checked against GEOMETRY. Stray keys are left out."""
    path = folder / _CONFIG_FILE
    if not path.is_file():
        raise ConfigError(
            f"codec.weights must name a local folder with {_CONFIG_FILE} and safetensors of the Wan2.2 VAE, found "
            f"no {path}; copy the vae folder of the diffusers layout there"
        )
    try:
        stored = json.loads(path.read_text())
    except ValueError as error:
        raise ConfigError(f"{path} must be JSON: {error}; copy it again") from error
    known = set(inspect.signature(AutoencoderKLWan.__init__).parameters) - {"self"}
    config = {name: value for name, value in stored.items() if name in known}
    for name, wanted in GEOMETRY.items():
        if config.get(name) != wanted:
            raise ConfigError(
                f"{path}: {name} must be {wanted}, found {config.get(name)}; this is not the Wan2.2 VAE of 48 channels"
            )
    for name in ("latents_mean", "latents_std"):
        if len(config.get(name, ())) != GEOMETRY["z_dim"]:
            raise ConfigError(f"{path}: {name} must hold 48 numbers, found {len(config.get(name, ()))}")
    return config


def _weight_files(folder: Path) -> tuple[Path, ...]:
    """The safetensors files of the folder: the single one, or those its index names."""
    index = folder / _INDEX_FILE
    names = [_WEIGHTS_FILE]
    if index.is_file():
        names = sorted(set(json.loads(index.read_text())["weight_map"].values()))
    files = tuple(folder / Path(name).name for name in names)  # names only: an index cannot lead out of the folder
    missing = [file.name for file in files if not file.is_file()]
    if missing:
        raise ConfigError(f"{folder} must hold the weights as safetensors, missing: {', '.join(missing)}")
    return files


def _convolutions(vae: AutoencoderKLWan) -> int:
    """Places for features that the encoder asks for: one for each causal convolution."""
    return sum(isinstance(module, WanCausalConv3d) for module in vae.encoder.modules())


def _load_tensors(vae: AutoencoderKLWan, files: Sequence[Path], folder: Path) -> None:
    """Fill every tensor of the network; one too few, too many or of another shape is refused."""
    try:
        tensors = {name: tensor for file in files for name, tensor in load_file(file).items()}
        vae.load_state_dict(tensors, strict=True, assign=True)
    except (SafetensorError, RuntimeError) as error:  # torch reports misfitting names and shapes as RuntimeError
        lines = str(error).splitlines()
        raise ConfigError(f"the weights in {folder} do not fit its {_CONFIG_FILE}: {' '.join(lines[:3])}") from error


def _pick_device(device: str) -> torch.device:
    if device not in ("auto", "cpu", "cuda"):
        raise ConfigError(f"codec.device must be auto, cpu or cuda, found {device!r}")
    has_cuda = torch.cuda.is_available()
    if device == "cuda" and not has_cuda:
        raise ConfigError("codec.device is cuda, but torch finds no CUDA device here; take auto or cpu")
    return torch.device("cuda" if has_cuda and device != "cpu" else "cpu")


def _describe(config: Mapping[str, Any], files: Sequence[Path], dtype: str) -> CodecInfo:
    """Identity from the bytes of the weights, the configuration and the dtype; not from paths, names or the device."""
    weights = sorted(sha256_file(file) for file in files)
    return CodecInfo(
        name="wan",
        digest=digest_json({"name": "wan", "config": dict(config), "weights_sha256": weights, "dtype": dtype}),
        channels=config["z_dim"],
        temporal_ratio=config["scale_factor_temporal"],
        spatial_ratio=config["scale_factor_spatial"],
        dtype=dtype,
        latent_mean=tuple(config["latents_mean"]),
        latent_std=tuple(config["latents_std"]),
        settings={"posterior": "mode", "weights_sha256": weights},
    )
