"""From the facts about the files of an episode to its record: one place where units, axes and names are converted."""

import hashlib
from collections.abc import Mapping

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import T_STORED_OPENCV
from wsm_data.readers.frames_digest import digest_frames
from wsm_data.readers.interndata.contents import FolderContents, FrameKey, ImageFacts
from wsm_data.readers.interndata.naming import Kind, frame_numbers, scene_offset
from wsm_data.readers.interndata.table import EpisodeTable
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId


def episode_numbers(folder: FolderContents, *, in_trajectory: bool, alone: bool) -> list[int]:
    """Numbers of the episodes that anything in the folder belongs to, so that one without a table is not forgotten.

    Nor is one of which meta/episodes.jsonl is all that is left. In a trajectory folder that file may number its one
    episode otherwise, or list the others of the scene; above trajectory folders it lists theirs, which are not here.

    Args:
        folder: what was found.
        in_trajectory: it is a trajectory folder.
        alone: the container has no other.
    """
    named = {episode for episode, _ in (*folder.rgb, *folder.depth) if episode is not None}
    unnamed = any(episode is None for episode, _ in (*folder.rgb, *folder.depth))
    found = {*folder.tables, *named, *(folder.spans if unnamed else ())}
    if in_trajectory:
        return sorted(found) or sorted(folder.lengths)[:1]
    return sorted({*found, *folder.lengths} if found or alone else found)


def build_record(
    id: EpisodeId,  # noqa: A002 - the field's name
    container: str,
    folder: FolderContents,
    number: int,
    dataset: DatasetManifest,
) -> tuple[EpisodeRecord, list[FrameKey]]:
    """Make the record of episode `number` of a folder.

    `camera_extrinsic` is the canonical mount: a rotation about x by (90 degrees - pitch) and a translation z = height.
    In OpenGL axes the camera looks along -z, which that rotation sends to (0, cos pitch, -sin pitch): ahead along +y,
    and down for a positive pitch. So the pitch is the angle of the forward axis below the horizontal.

    Returns:
        The record, and the keys of its depth images in time order.

    Raises:
        DataError: whatever makes the episode unusable.
    """
    where = f"{container}: episode {id.text}"
    table = folder.tables.get(number)
    if table is None and not _has_images(folder, number):
        raise DataError(
            Reason.EPISODE_MISSING,
            f"{where} is named by meta/episodes.jsonl and must have a table and images, found neither; "
            f"{folder.unread.advice(Kind.TABLE)}",
            {"episode": number},
        )
    if table is None:
        message = f"{where} has images but no data/chunk-*/episode_{number:06d}.parquet; "
        message += folder.unread.advice(Kind.TABLE)
        raise DataError(Reason.TABLE_UNREADABLE, message)
    if isinstance(table, DataError):
        raise table
    rgb, depth = _episode_images(folder, number, where)
    _require_limit(len(rgb), dataset.limits.max_frames, where)
    size = _common_size([image for _, image in rgb], [image for _, image in depth], where)
    frames = _require_row_count(table, len(rgb), where)
    T_to_opencv = T_STORED_OPENCV[dataset.camera_axes]
    frames_digest = digest_frames([image.digest for _, image in rgb], [image.digest for _, image in depth])
    record = EpisodeRecord(
        id=id,
        container=container,
        rgb_members=tuple(image.name for _, image in rgb),
        depth_members=tuple(image.name for _, image in depth),
        T_world_camera=table.T_world_stored @ T_to_opencv,
        intrinsics=_intrinsics(table.K, size, where),
        camera_height_m=float(table.T_mount[2, 3]),
        camera_pitch_rad=_pitch_down_rad(table.T_mount @ T_to_opencv),
        frames_digest=frames_digest,
        content_digest=_content_digest(frames_digest, table),
        notes=(Reason.EPISODE_LENGTH_MISMATCH.value,) if folder.lengths.get(number, frames) != frames else (),
    )
    return record, [key for key, _ in depth]


def _require_limit(frames: int, limit: int, where: str) -> None:
    if frames > limit:
        raise DataError(
            Reason.EPISODE_TOO_LONG,
            f"{where} must have at most {limit:,} images, and has {frames:,}; if it is right, raise max_frames in "
            "[limits] of the manifest",
            {"frames": frames, "limit": limit},
        )


def _has_images(folder: FolderContents, number: int) -> bool:
    owners = {episode for episode, _ in (*folder.rgb, *folder.depth)}
    return number in owners or (None in owners and number in folder.spans)


def _content_digest(frames_digest: str, table: EpisodeTable) -> str:
    """Digest of all that the record says, from values: float32 or float64, nested or flat, they are the same."""
    digest = hashlib.sha256(frames_digest.encode())
    for matrix in (table.K, table.T_mount, table.T_world_stored):
        digest.update(np.ascontiguousarray(matrix, "<f8").tobytes())
    return digest.hexdigest()


def _episode_images(
    folder: FolderContents, number: int, where: str
) -> tuple[list[tuple[FrameKey, ImageFacts]], list[tuple[FrameKey, ImageFacts]]]:
    """The colour and the depth images in time order, as many of one as of the other, each of them whole."""
    episode, first, last = _naming(folder, number, where)
    found = []
    for word, kind, images in (("colour", Kind.RGB, folder.rgb), ("depth", Kind.DEPTH, folder.depth)):
        candidates = [image for owner, image in images if owner == episode]
        numbers = frame_numbers(candidates, first, last, f"{where}: {word} images", folder.unread.advice(kind))
        found.append([((episode, image), images[episode, image]) for image in numbers])
    rgb, depth = found
    if len(rgb) != len(depth):
        raise DataError(
            Reason.FRAME_COUNT_MISMATCH,
            f"{where} must have as many depth images as colour images, found {len(depth)} and {len(rgb)}; fetch the "
            "scene again",
            {"rgb": len(rgb), "depth": len(depth)},
        )
    for _, image in (*rgb, *depth):
        if image.refusal is not None:
            raise image.refusal
    return rgb, depth


def _naming(folder: FolderContents, number: int, where: str) -> tuple[int | None, int, int | None]:
    """How the images of an episode are named: the episode in their names, and their first and last number."""
    keys = (*folder.rgb, *folder.depth)
    if any(episode == number for episode, _ in keys):
        return number, 0, None
    if number in folder.spans and len(folder.spans) > 1:
        offset = scene_offset((image for episode, image in keys if episode is None), folder.spans, where)
        span = folder.spans[number]
        return None, offset + span.first, offset + span.last
    if len(folder.tables) == 1:
        return None, 0, None
    raise DataError(
        Reason.FRAME_MISSING,
        f"{where}: no image carries its number, and meta/episodes_stats.jsonl does not say which images of the scene "
        f"are its own; {folder.unread.advice(Kind.RGB)}",
        {"episode": number, "episodes": len(folder.tables)},
    )


def _common_size(rgb: list[ImageFacts], depth: list[ImageFacts], where: str) -> tuple[int, int]:
    """Width and height of all images; there is one camera matrix for all of them."""
    sizes: Mapping[tuple[int, int] | None, str] = {image.size: image.name for image in reversed((*rgb, *depth))}
    if len(sizes) != 1:
        found = ", ".join(f"{name} {size}" for size, name in sizes.items())
        message = f"{where}: all images must have one size, colour and depth alike, found {found}"
        raise DataError(Reason.FRAME_SIZE_MISMATCH, message, {name: size for size, name in sizes.items()})
    size = next(iter(sizes))
    if size is None:
        raise ValueError("images that were refused have no size; they must not get here")
    return size


def _require_row_count(table: EpisodeTable, images: int, where: str) -> int:
    rows = len(table.T_world_stored)
    if rows != images:
        raise DataError(
            Reason.TABLE_ROW_COUNT,
            f"{where} must have a table row for every image, found {rows} rows and {images} images; which pose "
            "belongs to which image cannot be told",
            {"rows": rows, "images": images},
        )
    return rows


def _intrinsics(K: Float64Array, size: tuple[int, int], where: str) -> Intrinsics:
    width, height = size
    details = {"K": K.tolist(), "width": width, "height": height}
    if K[0, 1] != 0 or K[1, 0] != 0 or (K[2] != (0, 0, 1)).any():
        message = f"{where}: a camera matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], found {K.tolist()}"
        raise DataError(Reason.INTRINSICS_MISFIT, message, details)
    try:
        return Intrinsics(
            fx=float(K[0, 0]), fy=float(K[1, 1]), cx=float(K[0, 2]), cy=float(K[1, 2]), width=width, height=height
        )
    except ValueError as error:
        raise DataError(Reason.INTRINSICS_MISFIT, f"{where}: {error}", details) from error


def _pitch_down_rad(T_robot_camera: Float64Array) -> float:
    """Angle of the optical axis (z of an OpenCV camera) below the horizontal, rad."""
    x, y, z = T_robot_camera[:3, 2]
    return float(np.arctan2(-z, np.hypot(x, y)))
