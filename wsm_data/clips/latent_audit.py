"""Are the latents of a clip what its source gives today? Encoded again, compared, and what changed is named."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import cv2
import numpy as np

from wsm_data.clips.build import ClipVideos, read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.clip_video import pad_frames, padded_length
from wsm_data.codecs.images import rgb_pixels
from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.clip import Clip
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.verdict import Verdict

TOLERANCE = MappingProxyType({"float32": 3e-4, "bfloat16": 1e-2})
"""Largest relative difference, root of mean squares, by the arithmetic of the codec. Rounding to float16 alone is
2^-10 / sqrt(12) = 2.8e-4 at most, and to bfloat16 2.3e-3, which adds up over the layers of a network."""

MAX_SHIFT_FRAMES = 8
BETTER_BY = 3.0
"""A change is named that brings the difference below the tolerance, or to a third where rounding hides the rest."""

_RESIZES = MappingProxyType(
    {
        "nearest": cv2.INTER_NEAREST,
        "bilinear": cv2.INTER_LINEAR,
        "bicubic": cv2.INTER_CUBIC,
        "area, rounded to 256 levels": cv2.INTER_AREA,
        "Lanczos": cv2.INTER_LANCZOS4,
    }
)


@dataclass(frozen=True, kw_only=True)
class AuditedClip:
    """A clip and what its source holds of it.

    Attributes:
        clip: as the release has it.
        record: the trajectory.
        frames: its images.
        dataset: conventions of the source.
        codec: that of the release.
    """

    clip: Clip
    record: EpisodeRecord
    frames: EpisodeFrames
    dataset: DatasetManifest
    codec: VideoCodec


def audit_latents(audited: AuditedClip) -> Verdict:
    """Whether a clip's latents are those of its source.

    The reason names what changed: `latent.source_changed`, `latent.start_changed`, `latent.resize_changed`,
    `latent.dtype_changed`, `latent.channels_changed`; `latent.codec_changed` where nothing explains them and the
    release's codec decodes them to something else.

    Raises:
        DataError: a frame does not decode.
    """
    meta, record = audited.clip.meta, audited.record
    own_frames = meta.recorded_frames
    if record.content_digest != meta.source_digest or record.frame_count != own_frames:
        return Verdict(
            reason=Reason.LATENT_SOURCE_CHANGED,
            message=f"{meta.id.text}: the source must be what was encoded, {own_frames} frames with the digest "
            f"{meta.source_digest[:12]}, found {record.frame_count} with {record.content_digest[:12]}; encode it again",
            measured={"frames": record.frame_count, "digest": record.content_digest},
            limits={"frames": own_frames, "digest": meta.source_digest},
        )
    config = _clip_config(audited)
    videos = read_videos(record, audited.frames, audited.dataset, config)
    limit = TOLERANCE[audited.codec.describe().dtype]
    pairs = _pairs(audited.clip, videos)
    fresh = {kind: audited.codec.encode(video) for kind, (_, video) in pairs.items()}
    errors = {kind: difference(stored, fresh[kind]) for kind, (stored, _) in pairs.items()}
    limits = {f"{kind}_difference": limit for kind in errors}
    measured: dict[str, object] = {f"{kind}_difference": error for kind, error in errors.items()}
    if max(errors.values()) <= limit:
        return Verdict(measured=measured, limits=limits)
    worst = max(errors, key=lambda kind: errors[kind])
    reason, what, left = _explained(audited, worst, *pairs[worst], fresh[worst])
    found = ", ".join(f"{error:.2g} of {kind}" for kind, error in errors.items())
    message = (
        f"{meta.id.text}: latents must differ by {limit:.0e} at most from those of the source, found {found}; {what}"
    )
    return Verdict(reason=reason, message=message, measured={**measured, "explained_to": left}, limits=limits)


def difference(stored: np.ndarray, fresh: Float32Array) -> float:
    """Root of the mean squared difference of latents over that of the stored ones; infinite for other shapes."""
    if stored.shape != fresh.shape:
        return float("inf")
    one = stored.astype(np.float32)
    scale = float(np.sqrt(np.mean(one**2)))
    return float(np.sqrt(np.mean((one - fresh) ** 2))) / max(scale, float(np.finfo(np.float32).tiny))


def _clip_config(audited: AuditedClip) -> ClipConfig:
    meta = audited.clip.meta
    still = meta.frames - padded_length(audited.record.frame_count, 0)
    size = {"width": meta.intrinsics.width, "height": meta.intrinsics.height}
    return ClipConfig(**size, depth_range=meta.depth_range, still_frames=still, goal_radius_m=meta.goal_radius_m)


def _pairs(clip: Clip, videos: ClipVideos) -> dict[str, tuple[np.ndarray, Float32Array]]:
    """By kind, the latents of a clip and the video of its source; depth only where there is some."""
    pairs: dict[str, tuple[np.ndarray, Float32Array]] = {"rgb": (clip.rgb_latent, videos.rgb)}
    if clip.depth_latent is not None and videos.depth is not None:
        pairs["depth"] = clip.depth_latent, videos.depth
    return pairs


def _explained(
    audited: AuditedClip, kind: str, stored: np.ndarray, video: Float32Array, fresh: Float32Array
) -> tuple[Reason, str, float]:
    """The change that explains the latents of a kind best, in words, and the difference that it leaves.

    `fresh` are the latents of the video as it is.
    """
    plain = difference(stored, fresh)
    changes = {**_starts(video), **(_resizes(audited, video) if kind == "rgb" else {})}
    errors = {name: difference(stored, audited.codec.encode(changed())) for name, changed in changes.items()}
    errors[Reason.LATENT_DTYPE_CHANGED, "they were rounded to bfloat16"] = difference(stored, _bfloat16(fresh))
    best = min(errors, key=lambda name: errors[name])
    if errors[best] <= max(TOLERANCE[audited.codec.describe().dtype], plain / BETTER_BY):
        return (*best, errors[best])
    decoded = audited.codec.decode(stored.astype(np.float32))
    seen = float(np.sqrt(np.mean((decoded - video) ** 2)))
    what = (
        f"no change of start, size or rounding explains them: {kind} decodes to frames that are off by {seen:.2g} of 2"
    )
    return Reason.LATENT_CODEC_CHANGED, f"{what}; another codec wrote them, or another clip", errors[best]


Change = tuple[Reason, str]


def _starts(video: Float32Array) -> Mapping[Change, Callable[[], Float32Array]]:
    """The same trajectory from a later frame on, or with its first frame repeated."""

    def later(frames: int) -> Float32Array:
        return pad_frames(np.ascontiguousarray(video[frames:]), len(video))

    def earlier(frames: int) -> Float32Array:
        return np.concatenate([np.repeat(video[:1], frames, axis=0), video[:-frames]])

    moved: dict[Change, Callable[[], Float32Array]] = {}
    for frames in range(1, min(MAX_SHIFT_FRAMES, len(video) - 1) + 1):
        moved[Reason.LATENT_START_CHANGED, f"the clip starts {frames} frames later"] = partial(later, frames)
        moved[Reason.LATENT_START_CHANGED, f"the clip starts {frames} frames earlier"] = partial(earlier, frames)
    return moved


def _resizes(audited: AuditedClip, video: Float32Array) -> Mapping[Change, Callable[[], Float32Array]]:
    """Colour resized in other ways, and with red and blue exchanged."""
    height, width = video.shape[1:3]

    def resized(how: int) -> Float32Array:
        where = audited.record.id.text
        images = [cv2.resize(rgb_pixels(one, where), (width, height), interpolation=how) for one in audited.frames.rgb]
        return pad_frames(np.stack(images).astype(np.float32) / np.float32(127.5) - 1, len(video))

    changes: dict[Change, Callable[[], Float32Array]] = {
        (Reason.LATENT_RESIZE_CHANGED, f"colour was resized otherwise: {name}"): partial(resized, how)
        for name, how in _RESIZES.items()
    }
    exchanged = Reason.LATENT_CHANNELS_CHANGED, "red and blue are exchanged"
    changes[exchanged] = lambda: np.ascontiguousarray(video[..., ::-1])
    return changes


def _bfloat16(latent: Float32Array) -> Float32Array:
    """Rounded to the 8 bits of bfloat16, half to even, as float32."""
    bits = np.ascontiguousarray(latent).view(np.uint32)
    rounded = bits + np.uint32(0x7FFF) + ((bits >> np.uint32(16)) & np.uint32(1))
    return (rounded & np.uint32(0xFFFF0000)).view(np.float32)
