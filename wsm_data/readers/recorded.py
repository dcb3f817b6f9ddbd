"""From a recording whose poses, camera and images are files in a folder to records: shared by readers of such sources.

A mount is not stated there: height and pitch of a trajectory are those of its first frame above the floor.
"""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes
from wsm_data.errors import DataError, Reason
from wsm_data.files.digest import xxh3_128
from wsm_data.readers.floor import floor_z_m
from wsm_data.readers.frames_digest import ABSENT, digest_frames, source_changed, verified_frames
from wsm_data.readers.images import check_png16, check_rgb
from wsm_data.readers.source import ContainerScan, DepthSample
from wsm_data.readers.thinning import pieces
from wsm_data.readers.unreadable import read_file
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.identity import EpisodeId
from wsm_data.schema.verdict import Refusal


@dataclass(frozen=True, kw_only=True)
class Recording:
    """The frames of a folder that are kept, in time order.

    Attributes:
        container: id of the folder's container.
        group: group of its trajectories; the last `_`-separated word names the camera.
        scene: name of the scene.
        episode: name of the recording where a scene has several; its trajectories are numbered where it is cut.
        rgb: names of the N colour images.
        depth: names of the N depth images, empty where a frame has none.
        T_world_camera: float64 [N, 4, 4].
        intrinsics: of all images.
        notes: reason codes of what was left out.
        goal_world_m: where the recording as a whole leads to, m; None: to its last position.
    """

    container: str
    group: str
    scene: str
    rgb: tuple[str, ...]
    depth: tuple[str, ...]
    T_world_camera: Float64Array
    intrinsics: Intrinsics
    episode: str = ""
    notes: tuple[str, ...] = ()
    goal_world_m: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class PieceImages:
    """What was read of the images of one trajectory.

    Attributes:
        frames_digest: of all of them.
        samples: every n-th depth image.
        bytes_read: of their files.
    """

    frames_digest: str
    samples: tuple[DepthSample, ...]
    bytes_read: int


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """One trajectory of a recording, read."""

    id: EpisodeId
    frames: slice
    images: PieceImages


def scan_recording(folder: Path, recording: Recording, dataset: DatasetManifest, sample_every: int) -> ContainerScan:
    """Read the images of a recording once, and make records of its trajectories.

    Raises:
        DataError: `floor.unseen`.
    """
    return scan_pieces(recording, dataset, lambda frames: _read_files(folder, recording, frames, sample_every))


def scan_pieces(
    recording: Recording, dataset: DatasetManifest, read_images: Callable[[slice], PieceImages]
) -> ContainerScan:
    """Make records of the trajectories of a recording, whose images are read by `read_images`, frames given.

    Raises:
        DataError: `floor.unseen`.
    """
    read: list[_Piece] = []
    refusals = []
    cut = pieces(len(recording.rgb), dataset.motion.max_frames)
    for number, frames in enumerate(cut):
        name = f"{recording.episode}_{number:06d}" if recording.episode else f"{number:06d}"
        id_ = EpisodeId(recording.group, recording.scene, (recording.episode if len(cut) == 1 else "") or name)
        try:
            read.append(_Piece(id=id_, frames=frames, images=read_images(frames)))
        except DataError as error:
            refusals.append(Refusal.from_error(id_.text, recording.container, error))
    floor = _floor_z_m(recording, read, dataset) if read else 0.0
    return ContainerScan(
        records=tuple(_record(recording, piece, floor) for piece in read),
        refusals=tuple(refusals),
        cloud=None,
        cloud_refusal=None,
        depth_samples={piece.id.text: piece.images.samples for piece in read},
        bytes_read=sum(piece.images.bytes_read for piece in read),
    )


def iter_recorded(folder: Path, records: Sequence[EpisodeRecord]) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    """Yield the images of the wanted trajectories of a folder in the order of `records`, each read when asked for.

    Raises:
        IntegrityError: the images are not those of the first pass.
    """
    for record in records:
        try:
            rgb = [read_file(f"{folder}/{name}", f"{record.container}:{name}") for name in record.rgb_members]
            depth = [
                None if name == ABSENT else read_file(f"{folder}/{name}", f"{record.container}:{name}")
                for name in record.depth_members
            ]
        except DataError as error:
            raise source_changed(record.container, error.message) from error
        yield record, verified_frames(record, rgb, depth)


def image_size(folder: Path, name: str, where: str) -> tuple[int, int]:
    """Width and height of a colour image.

    Raises:
        DataError: `file.unreadable` or a `frame.*` reason.
    """
    return check_rgb(memoryview(read_file(f"{folder}/{name}", f"{where}:{name}")), f"{where}:{name}")


def _read_files(folder: Path, recording: Recording, frames: slice, every: int) -> PieceImages:
    size = recording.intrinsics.width, recording.intrinsics.height
    digests: tuple[list[str], list[str]] = ([], [])
    samples: list[DepthSample] = []
    total = 0
    for index, names in enumerate(zip(recording.rgb[frames], recording.depth[frames], strict=True)):
        for kind, name in enumerate(names):
            where = f"{recording.container}:{name}"
            if name == ABSENT:
                digests[kind].append(ABSENT)
                continue
            data = read_file(f"{folder}/{name}", where)
            _require_size((check_rgb, check_png16)[kind](memoryview(data), where), size, where)
            digests[kind].append(xxh3_128(data))
            total += len(data)
            if kind and index % every == 0:
                samples.append((index, data))
    return PieceImages(frames_digest=digest_frames(*digests), samples=tuple(samples), bytes_read=total)


def _require_size(found: tuple[int, int], wanted: tuple[int, int], where: str) -> None:
    if found != wanted:
        raise DataError(
            Reason.FRAME_SIZE_MISMATCH,
            f"{where}: all images of a recording, colour and depth alike, must be {wanted[0]} x {wanted[1]} px as its "
            f"first colour image is, found {found[0]} x {found[1]}; export both at one size",
            {"size_px": found, "expected_px": wanted},
        )


def _floor_z_m(recording: Recording, read: Sequence[_Piece], dataset: DatasetManifest) -> float:
    if dataset.motion.floor_z_m is not None:
        return dataset.motion.floor_z_m
    frames = (
        (
            depth_m_from_raw(depth_codes(image, f"{piece.id.text}, depth frame {index}"), dataset.depth),
            recording.T_world_camera[piece.frames][index],
        )
        for piece in read
        for index, image in piece.images.samples
    )
    return floor_z_m(frames, recording.intrinsics, recording.container)


def _record(recording: Recording, piece: _Piece, floor: float) -> EpisodeRecord:
    T_world_camera = recording.T_world_camera[piece.frames]
    is_last = piece.frames.stop == len(recording.rgb)  # the pieces before it lead to where they end
    goal_world_m = recording.goal_world_m if is_last else None
    return EpisodeRecord(
        id=piece.id,
        container=recording.container,
        rgb_members=recording.rgb[piece.frames],
        depth_members=recording.depth[piece.frames],
        T_world_camera=T_world_camera,
        intrinsics=recording.intrinsics,
        camera_height_m=float(T_world_camera[0, 2, 3]) - floor,
        camera_pitch_rad=float(np.arcsin(np.clip(-T_world_camera[0, 2, 2], -1.0, 1.0))),
        frames_digest=piece.images.frames_digest,
        content_digest=_content_digest(
            piece.images.frames_digest, T_world_camera, recording.intrinsics, floor, goal_world_m
        ),
        notes=recording.notes,
        goal_world_m=goal_world_m,
    )


def _content_digest(
    frames_digest: str,
    T_world_camera: Float64Array,
    intrinsics: Intrinsics,
    floor: float,
    goal_world_m: tuple[float, ...] | None,
) -> str:
    digest = hashlib.sha256(frames_digest.encode())
    for values in (intrinsics.matrix, T_world_camera, np.array([floor]), np.array(goal_world_m or ())):
        digest.update(np.ascontiguousarray(values, "<f8").tobytes())
    return digest.hexdigest()
