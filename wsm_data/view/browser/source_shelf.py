"""A source on its way to pages: its containers, the trajectories of one that is opened, and their images."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes, rgb_pixels
from wsm_data.errors import ConfigError, DataError
from wsm_data.files.json_values import to_json
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.readers.registry import source_reader
from wsm_data.readers.source import Container
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames
from wsm_data.schema.verdict import Refusal
from wsm_data.view.browser.kept import Kept
from wsm_data.view.browser.named_image import decode_damaged, named_image
from wsm_data.view.drawing.depth_colours import depth_picture
from wsm_data.view.drawing.jpeg import jpeg, thumbnail

_KEPT_CONTAINERS = 8
_KEPT_EPISODES = 2
_KEPT_THUMBNAILS = 500
_NO_DEPTH_SAMPLES = 1_000_000
"""Of depth images a scan keeps every so many, for a map that nobody makes here."""
_NORTH_UP = np.array([1.0, -1.0])


@dataclass(frozen=True, kw_only=True)
class _Scanned:
    container: Container
    records: Mapping[str, EpisodeRecord]
    refusals: tuple[Refusal, ...]


class SourceShelf:
    """What pages ask of a source. A container is read when it is opened; methods may be called from many threads.

    All of them raise ConfigError where a container, trajectory or frame is not there, DataError where an image cannot
    be decoded, and IntegrityError where the source changed while it was looked at.
    """

    def __init__(self, root: Path, dataset: DatasetManifest) -> None:
        self.root, self.dataset = root, dataset
        self._reader = source_reader(dataset)
        self._containers = {one.id: one for one in self._reader.find_containers(root, dataset)}
        self._scans = Kept(self._scan, _KEPT_CONTAINERS)
        self._frames = Kept(self._read_frames, _KEPT_EPISODES)
        self._thumbnails = Kept(self._thumbnail, _KEPT_THUMBNAILS)

    def about(self) -> dict[str, Any]:
        """What the source is; JSON values."""
        return {
            "where": str(self.root),
            "dataset": self.dataset.name,
            "reader": self.dataset.reader,
            "containers": len(self._containers),
        }

    def containers(self, text: str, offset: int, limit: int) -> dict[str, Any]:
        """Some of the containers with a text in their id, and how many there are; JSON values."""
        found = [one for one in self._containers.values() if text.casefold() in one.id.casefold()]
        shown = found[offset : offset + limit]
        return {"total": len(found), "containers": [{"id": one.id, "layout": one.layout} for one in shown]}

    def container(self, name: str) -> dict[str, Any]:
        """The trajectories of a container, and what of it cannot be used, with reasons; JSON values."""
        scanned = self._scans.get(name)
        episodes = [
            {"unit": unit, "frames": record.frame_count, "has_depth": record.has_depth, "notes": list(record.notes)}
            for unit, record in scanned.records.items()
        ]
        return {"id": name, "episodes": episodes, "refusals": [to_json(one) for one in scanned.refusals]}

    def page(self, container: str, unit: str) -> dict[str, Any]:
        """All that the page of a trajectory shows beside its images; JSON values, in the form of a clip's.

        There is no map yet: the path is drawn on an empty one, a cell for every 5 cm.
        """
        record = self._record(container, unit)
        depth, intrinsics = DepthRange(), record.intrinsics
        facts = {
            "frames": str(record.frame_count),
            "path length": f"{np.linalg.norm(np.diff(record.path_xy_m, axis=0), axis=1).sum():.2f} m",
            "camera": f"{record.camera_height_m:.2f} m high, {np.rad2deg(record.camera_pitch_rad):.1f}° down",
            "image": f"{intrinsics.width} x {intrinsics.height} px, fx {intrinsics.fx:.1f} px",
            "notes": ", ".join(record.notes) or "none",
        }
        return {
            "key": unit,
            "unit": unit,
            "frames": record.frame_count,
            "width": intrinsics.width,
            "height": intrinsics.height,
            "has_depth": record.has_depth,
            "depth_m": [depth.min_m, depth.max_m],
            "facts": list(facts.items()),
            "distance_m": [],
            "texts": {"container": container},
            "scores": [],
            "map": _empty_map(record),
        }

    def frame(self, container: str, unit: str, kind: str, number: int) -> bytes:
        """An image of a trajectory, `rgb` or `depth` in colours; JPEG."""
        record, frames = self._frames.get((container, unit))
        if kind not in ("rgb", "depth") or number >= record.frame_count:
            raise ConfigError(f"{unit} has no {kind} frame {number}; it has {record.frame_count} frames, from 0")
        where = f"{unit}, {kind} frame {number}"
        if kind == "rgb":
            return jpeg(rgb_pixels(frames.rgb[number], where))
        image = frames.depth[number]
        if image is None:
            raise ConfigError(f"{where}: there is no depth image")
        return jpeg(depth_picture(depth_m_from_raw(depth_codes(image, where), self.dataset.depth), DepthRange()))

    def thumbnail(self, container: str, unit: str) -> bytes:
        """The first image of a trajectory, small; JPEG."""
        return self._thumbnails.get((container, unit))

    def damaged(self, message: str) -> bytes:
        """What can still be decoded of the image that the message of a refusal names; JPEG."""
        named = named_image(message)
        if named is None:
            raise ConfigError("the refusal names no image")
        return jpeg(decode_damaged(self.root, *named))

    def place_of(self, unit: str, source: str) -> tuple[str, str] | None:
        """Container and trajectory of a refusal, where it is of a trajectory whose images can be read.

        Args:
            unit: id that the refusal names.
            source: what it says the unit came from; a container, or something in one.
        """
        inside = [one for one in self._containers if source == one or source.startswith(f"{one}/")]
        if not inside:
            return None
        container = max(inside, key=len)
        return (container, unit) if unit in self._scans.get(container).records else None

    def _scan(self, name: str) -> _Scanned:
        if name not in self._containers:
            raise ConfigError(f"the source has no container {name!r}; {did_you_mean(name, self._containers)}")
        container = self._containers[name]
        try:
            scan = self._reader.scan(self.root, container, self.dataset, _NO_DEPTH_SAMPLES)
        except DataError as error:
            return _Scanned(container=container, records={}, refusals=(Refusal.from_error(name, name, error),))
        refusals = (*scan.refusals, *([scan.cloud_refusal] if scan.cloud_refusal else []))
        return _Scanned(container=container, records={one.id.text: one for one in scan.records}, refusals=refusals)

    def _record(self, container: str, unit: str) -> EpisodeRecord:
        records = self._scans.get(container).records
        if unit not in records:
            raise ConfigError(f"{container} has no usable trajectory {unit!r}; {did_you_mean(unit, records)}")
        return records[unit]

    def _read_frames(self, place: tuple[str, str]) -> tuple[EpisodeRecord, EpisodeFrames]:
        record = self._record(*place)
        container = self._scans.get(place[0]).container
        return next(iter(self._reader.iter_frames(self.root, container, self.dataset, [record])))

    def _thumbnail(self, place: tuple[str, str]) -> bytes:
        _, frames = self._frames.get(place)
        return thumbnail(rgb_pixels(frames.rgb[0], f"{place[1]}, first frame"))


def _empty_map(record: EpisodeRecord) -> dict[str, Any]:
    cell_m, margin_m = 0.05, 1.0
    path_m, goal_m = record.path_xy_m, record.goal_m[:2]
    points_m = np.concatenate([path_m, goal_m[None]])
    corner_m = np.array([points_m[:, 0].min() - margin_m, points_m[:, 1].max() + margin_m])
    columns, rows = np.ceil((np.ptp(points_m, axis=0) + 2 * margin_m) / cell_m).astype(int).tolist()
    return {
        "columns": columns,
        "rows": rows,
        "cell_m": cell_m,
        "line_every_m": 0.0,
        "path": ((path_m - corner_m) * _NORTH_UP / cell_m).round(2).tolist(),
        "goal": ((goal_m - corner_m) * _NORTH_UP / cell_m).round(2).tolist(),
        "goal_radius": 0.2 / cell_m,
        "robot_radius": 0.2 / cell_m,
    }
