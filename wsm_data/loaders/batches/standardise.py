"""Latents to mean 0 and standard deviation 1, in float32 arithmetic, on the processor or on a device.

The result is (x - mean) * (1 / std) with each operation rounded to float32, then rounded to the dtype of the batch: the
same bits on every processor and with any number of threads.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from wsm_data.errors import ConfigError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.shards.latent_standard import latent_standard
from wsm_data.shards.manifest import ReleaseManifest

_SERIAL_ELEMENTS = 32_768
"""Torch splits longer operations among threads of its own (`at::internal::GRAIN_SIZE`), a pool of them for each thread
that reads ahead; shorter blocks also stay in the cache between the three passes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Standardisation:
    """Mean and scale of one kind of latents.

    Attributes:
        mean: float32 [C, 1, 1].
        scale: 1 / standard deviation; float32 [C, 1, 1].
    """

    mean: torch.Tensor
    scale: torch.Tensor

    def whole(self, latents: torch.Tensor, dtype: torch.dtype) -> torch.Tensor:
        """Standardise latents [..., C, h, w] on their own device, into new memory."""
        mean, scale = self.mean.to(latents.device), self.scale.to(latents.device)
        return latents.to(torch.float32).sub_(mean).mul_(scale).to(dtype)


def convert(stored: torch.Tensor, out: torch.Tensor, standardisation: Standardisation | None) -> None:
    """Standardise latents on the processor, in the thread of the caller alone.

    Args:
        stored: as they are stored; float16 [F, C, h, w].
        out: where they go; [F, C, h, w] of any floating dtype, without overlap with `stored`.
        standardisation: mean and scale; None: only the dtype changes.
    """
    block = max(1, _SERIAL_ELEMENTS // max(1, stored[:1].numel()))
    direct = out.dtype is torch.float32
    work = torch.empty((0 if direct else block, *out.shape[1:]), dtype=torch.float32)
    for source, target in zip(stored.split(block), out.split(block), strict=True):
        values = target if direct else work[: len(source)]
        values.copy_(source)
        if standardisation is not None:
            values.sub_(standardisation.mean)
            values.mul_(standardisation.scale)
        if not direct:
            target.copy_(values)


def standardisations(
    manifest: ReleaseManifest, *, depth: bool = True, standard: LatentStandard | None = None
) -> Mapping[str, Standardisation]:
    """How `rgb` and, where it is asked for, `depth` latents of a release are standardised.

    Args:
        manifest: of the release.
        depth: whether depth is asked for.
        standard: by which numbers; None: those of the release.

    Raises:
        ConfigError: the release has no statistics, for want of training clips or of their depth, or the standard is
            that of another codec.
    """
    standard = latent_standard(manifest) if standard is None else standard
    if standard.codec_digest != manifest.codec.digest:
        raise ConfigError(
            f"latents of {manifest.name} are those of {manifest.codec.name} (digest {manifest.codec.digest}), and "
            f"cannot be standardised by the numbers of {standard.codec} (digest {standard.codec_digest}); use data of "
            "that codec"
        )
    rgb = {"rgb": _standardisation(standard.rgb_mean, standard.rgb_std)}
    if not depth:
        return rgb
    if not standard.depth_mean:
        raise ConfigError(
            f"the release {manifest.name} must have depth to deliver it, and no clip of its split `train` has any; set "
            "depth = false where batches need none"
        )
    return {**rgb, "depth": _standardisation(standard.depth_mean, standard.depth_std)}


def _standardisation(mean: tuple[float, ...], std: tuple[float, ...]) -> Standardisation:
    return Standardisation(mean=_column(np.array(mean)), scale=_column(1 / np.array(std, np.float64)))


def _column(values: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(values.astype(np.float32)).view(-1, 1, 1)
