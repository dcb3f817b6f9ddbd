"""One episode of a LeRobot data set: the first pass over its rows and videos, and the frames that are kept."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.files.digest import digest_json
from wsm_data.readers.folder_signature import folder_signature
from wsm_data.readers.frames_digest import ABSENT, source_changed
from wsm_data.readers.lerobot.depth_codes import quantisation_of, raw_depth_table
from wsm_data.readers.lerobot.meta import DatasetInfo, EpisodePlace, read_info, read_places, unreadable
from wsm_data.readers.lerobot.rows import EpisodeRows, read_rows
from wsm_data.readers.lerobot.video import VideoPart, decoded, depth_codes, packets_digest, rgb_u8
from wsm_data.readers.recorded import PieceImages, Recording, scan_pieces
from wsm_data.readers.source import Container, ContainerScan, DepthSample
from wsm_data.readers.thinning import moving_frames
from wsm_data.schema.arrays import Float64Array, Int64Array, Uint8Array, Uint16Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CameraModel, DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames

_TOLERANCE_FRAMES = 0.4
"""A frame of a video belongs to a row whose time is nearer than this share of the time between two frames."""


def video_features(dataset: DatasetManifest) -> list[str]:
    """The videos that are read: colour, and depth where the manifest names one."""
    features = dataset.features
    return [features.rgb, *([features.depth] if features.depth else [])]


def episode_number(container: Container) -> int:
    """The index of an episode, from the name of its container."""
    return int(container.id.rpartition("_")[2])


def scan_episode(root: Path, container: Container, dataset: DatasetManifest, sample_every: int) -> ContainerScan:
    """Read an episode: its rows, then every frame that is kept.

    Raises:
        DataError: the episode cannot be used.
    """
    episode = _Episode(root, container, dataset)
    rows = episode.rows
    kept = moving_frames(rows.T_world_camera, dataset.motion)
    size = next(iter(decoded(episode.part(dataset.features.rgb, kept[:1]), rgb_u8))).shape
    depth = dataset.features.depth
    recording = Recording(
        container=container.id,
        group=f"{dataset.name}_{dataset.features.camera}",
        scene=f"{root.resolve().name}_{episode.place.index:06d}",
        rgb=tuple(f"{dataset.features.rgb}@{frame:06d}" for frame in kept.tolist()),
        depth=tuple(f"{depth}@{frame:06d}" if depth else ABSENT for frame in kept.tolist()),
        T_world_camera=rows.T_world_camera[kept],
        intrinsics=_intrinsics(rows, (size[1], size[0]), dataset, container.id),
    )
    return scan_pieces(recording, dataset, partial(episode.read_images, kept, recording.intrinsics, sample_every))


def iter_episode(
    root: Path, container: Container, dataset: DatasetManifest, records: Sequence[EpisodeRecord]
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    """Decode the wanted trajectories of an episode, one after the other.

    Raises:
        IntegrityError: its files are not those of the first pass.
    """
    try:
        episode = _Episode(root, container, dataset)
        for record in records:
            frames = np.array([int(name.rpartition("@")[2]) for name in record.rgb_members], np.int64)
            if episode.digest(frames)[0] != record.frames_digest:
                raise source_changed(container.id, f"the videos of {record.id.text} have other bytes")
            depth: Sequence[Uint16Array | None] = [None] * len(frames)
            if dataset.features.depth:
                depth = list(episode.raw_depth(frames))
            yield record, EpisodeFrames(rgb=list(episode.colour(frames)), depth=depth)
    except DataError as error:
        raise source_changed(container.id, error.message) from error


class _Episode:
    """What is known of an episode, and its frames by number.

    Args:
        root: of the data set.
        container: the episode.
        dataset: conventions.

    Raises:
        DataError: its meta data or rows cannot be used.
    """

    def __init__(self, root: Path, container: Container, dataset: DatasetManifest):
        self._root, self._dataset, self._where = root, dataset, container.id
        self._info: DatasetInfo = read_info(root)
        self.place: EpisodePlace = _place_of(root, self._info, container, dataset)
        self.rows: EpisodeRows = read_rows(root, self.place, dataset, container.id)

    def part(self, feature: str, frames: Int64Array) -> VideoPart:
        """Some frames of the video of a feature."""
        file, begins_s = self.place.videos[feature]
        return VideoPart(
            path=self._root / file,
            where=f"{self._where}:{file}",
            times_s=begins_s + self.rows.times_s[frames],
            tolerance_s=_TOLERANCE_FRAMES / self._info.fps,
            max_pixels=self._dataset.limits.max_image_pixels,
        )

    def colour(self, frames: Int64Array) -> Iterator[Uint8Array]:
        """Colour of frames, [H, W, 3] each."""
        return decoded(self.part(self._dataset.features.rgb, frames), rgb_u8)

    def raw_depth(self, frames: Int64Array) -> Iterator[Uint16Array]:
        """Depth of frames in the units of the manifest, [H, W] each.

        Raises:
            DataError: `sequence.unreadable`: the feature does not say how it was quantised.
        """
        name = self._dataset.features.depth
        try:
            quantisation = quantisation_of(self._info.features[name])
        except (ValueError, KeyError, TypeError) as error:
            raise unreadable(
                f"{self._where}: the feature {name} must be a depth video of LeRobot, but {error}"
            ) from error
        table = raw_depth_table(quantisation, self._dataset.depth.metres_per_unit)
        for codes in decoded(self.part(name, frames), depth_codes):
            yield table[np.minimum(codes, len(table) - 1)]

    def digest(self, frames: Int64Array) -> tuple[str, int]:
        """Digest of the stored bytes of frames, of which times and features are a part, and how many bytes they are."""
        parts = [packets_digest(self.part(feature, frames)) for feature in video_features(self._dataset)]
        times = self.rows.times_s[frames].tolist()
        return digest_json([[one for one, _ in parts], frames.tolist(), times]), sum(size for _, size in parts)

    def read_images(self, kept: Int64Array, intrinsics: Intrinsics, every: int, frames: slice) -> PieceImages:
        """Decode every frame of a trajectory once, so that what cannot be decoded is refused now."""
        numbers = kept[frames]
        for image in self.colour(numbers):
            _require_size(image, intrinsics, f"{self._where}, {self._dataset.features.rgb}")
        samples: list[DepthSample] = []
        if self._dataset.features.depth:
            for index, raw in enumerate(self.raw_depth(numbers)):
                _require_size(raw, intrinsics, f"{self._where}, {self._dataset.features.depth}")
                if index % every == 0:
                    samples.append((index, raw))
        frames_digest, total = self.digest(numbers)
        return PieceImages(frames_digest=frames_digest, samples=tuple(samples), bytes_read=total)


def _place_of(root: Path, info: DatasetInfo, container: Container, dataset: DatasetManifest) -> EpisodePlace:
    for feature in video_features(dataset):
        found = info.features.get(feature, {}).get("dtype")
        if found != "video":
            videos = [name for name, one in info.features.items() if one.get("dtype") == "video"]
            raise unreadable(
                f"{container.id} must have a video {feature!r}, found {found or 'no such feature'}; its videos are "
                f"{', '.join(videos) or 'none'}: name them in [features] of the manifest"
            )
    places = _known_places(root, tuple(video_features(dataset)), folder_signature(root / "meta"))
    index = episode_number(container)
    if index not in places:
        raise unreadable(f"{container.id} must stand in the table of episodes, which has {len(places)} others")
    return places[index]


@lru_cache(maxsize=1)
def _known_places(root: Path, videos: tuple[str, ...], signature: str) -> Mapping[int, EpisodePlace]:
    """The table of episodes, kept while no file of meta/ is touched: every episode is a container, and asks for it.

    To read that of 50,000 episodes takes 2 s.
    """
    del signature
    return read_places(root, read_info(root), videos)


def _intrinsics(rows: EpisodeRows, size: tuple[int, int], dataset: DatasetManifest, where: str) -> Intrinsics:
    """The camera as its feature says it, or else as the manifest publishes it, for images of a (width, height)."""
    values: Sequence[float | None]
    if rows.intrinsics is not None:
        values = rows.intrinsics
    else:
        model = dataset.cameras.get(dataset.features.camera, CameraModel())
        published = (model.width, model.height) == size
        values = (model.fx, model.fy, model.cx, model.cy) if published else (None,)
    if None in values:
        raise DataError(
            Reason.INTRINSICS_MISFIT,
            f"{where}: the manifest must have features.intrinsics, or a published camera "
            f"{dataset.features.camera!r} for images of {size[0]} x {size[1]} px",
            {"size_px": size},
        )
    fx, fy, cx, cy = (float(value) for value in values if value is not None)
    try:
        return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=size[0], height=size[1])
    except ValueError as error:
        raise DataError(Reason.INTRINSICS_MISFIT, f"{where}: {error}", {"fx": fx, "cx": cx}) from error


def _require_size(image: Uint8Array | Uint16Array | Float64Array, wanted: Intrinsics, where: str) -> None:
    if image.shape[:2] != (wanted.height, wanted.width):
        raise DataError(
            Reason.FRAME_SIZE_MISMATCH,
            f"{where}: colour and depth must be {wanted.width} x {wanted.height} px as the first colour frame is, "
            f"found {image.shape[1]} x {image.shape[0]}; export both at one size",
            {"size_px": [image.shape[1], image.shape[0]]},
        )
