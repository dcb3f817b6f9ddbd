"""A small builder of source trees: real images, tables and clouds of a few frames, in every layout."""

import gzip
import io
import json
import tarfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.readers.interndata.containers import find_containers
from wsm_data.readers.interndata.scan import scan_container
from wsm_data.readers.source import Container, ContainerScan
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding

WIDTH, HEIGHT = 32, 24
GROUP, SCENE = "gibson_d435i", "Acker.ville"
COLUMNS = {"K": "observation.camera_intrinsic", "mount": "observation.camera_extrinsic"}
Files = dict[str, bytes]
RGB, DEPTH = "videos/chunk-000/observation.images.rgb", "videos/chunk-000/observation.images.depth"


@dataclass(kw_only=True)
class Episode:
    """What a source stores of one trajectory; tests break single fields of it."""

    rgb: list[bytes]
    depth: list[bytes]
    K: np.ndarray
    mount: np.ndarray
    poses: np.ndarray


class TreeBuilder:
    """Episodes, and the files they become in each layout; paths are relative to the scene or trajectory."""

    width, height = WIDTH, HEIGHT
    group, scene = GROUP, SCENE
    rgb_folder, depth_folder = RGB, DEPTH

    def episode(self, seed: int, frames: int = 7, height_m: float = 0.5, pitch_deg: float = 10.0) -> Episode:
        rng = np.random.default_rng(seed)
        images = rng.integers(0, 256, (frames, HEIGHT, WIDTH, 3), dtype=np.uint8)
        depths = rng.integers(5000, 40000, (frames, HEIGHT, WIDTH), dtype=np.uint16)
        mount = mount_matrix(height_m, pitch_deg)
        poses = np.stack([yawed(mount, 0.05 * t, (0.02 * t, 0.08 * t + seed, 0.0)) for t in range(frames)])
        return Episode(
            rgb=[encoded(".jpg", image) for image in images],
            depth=[encoded(".png", depth) for depth in depths],
            K=np.array([[24.0, 0, 15.5], [0, 24.0, 11.5], [0, 0, 1]], np.float32),
            mount=mount.astype(np.float32),
            poses=poses.astype(np.float32),
        )

    def table(
        self,
        episode: Episode,
        *,
        nested: bool = True,
        drop: str = "",
        index: np.ndarray | None = None,
        **columns: np.ndarray,
    ) -> bytes:
        """The parquet file; `columns` replace whole columns of matrices [T, n, n], `index` the numbers of the rows."""
        rows = len(episode.poses)
        matrices = {
            "observation.camera_intrinsic": np.repeat(episode.K[None], rows, axis=0),
            "observation.camera_extrinsic": np.repeat(episode.mount[None], rows, axis=0),
            "action": episode.poses,
        }
        for name, values in columns.items():
            matrices[{"K": "observation.camera_intrinsic", "mount": "observation.camera_extrinsic"}.get(name, name)] = (
                values
            )
        arrays = {"index": pa.array(np.arange(rows) if index is None else index)}
        for name, values in matrices.items():
            lists = values.tolist() if nested else values.reshape(len(values), -1).tolist()
            kind = pa.list_(pa.list_(pa.float32())) if nested else pa.list_(pa.float32())
            arrays[name] = pa.array(lists, kind)
        arrays.pop(drop, None)
        buffer = io.BytesIO()
        pq.write_table(pa.table(arrays), buffer)
        return buffer.getvalue()

    def cloud(self, points: int = 50, black: int = 0) -> bytes:
        rows = np.zeros(points, [("xyz", "<f4", 3), ("rgb", "u1", 3)])
        rows["xyz"] = np.random.default_rng(1).uniform(-2, 2, (points, 3))
        rows["rgb"] = (0, 0, 128)
        rows["rgb"][:black] = 0
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n"
        fields = [f"property float {a}\n" for a in "xyz"] + [f"property uchar {c}\n" for c in ("red", "green", "blue")]
        return (header + "".join(fields) + "end_header\n").encode() + rows.tobytes()

    def scene_files(
        self, episodes: Mapping[int, Episode], *, nested: bool = True, prefixed: bool = True, cloud: bool = True
    ) -> Files:
        """Layout 2; `prefixed=False` numbers the images through the whole scene."""
        files, start, stats, lengths = {}, 0, [], []
        for number, episode in sorted(episodes.items()):
            frames = len(episode.rgb)
            files[f"data/chunk-000/episode_{number:06d}.parquet"] = self.table(episode, nested=nested)
            for t in range(frames):
                stem = f"episode_{number:06d}_{t:03d}" if prefixed else str(start + t)
                files[f"{RGB}/{stem}.jpg"] = episode.rgb[t]
                files[f"{DEPTH}/{stem}.png"] = episode.depth[t]
            stats.append({"episode_index": number, "image_index": {"min": start, "max": start + frames - 1}})
            lengths.append({"episode_index": number, "length": frames})
            start += frames
        files["meta/episodes.jsonl"] = json_lines(lengths)
        files["meta/episodes_stats.jsonl"] = json_lines(stats)
        files["meta/info.json"] = b"{}"
        files["videos/chunk-000/observation.video.rgb/episode_000000.mp4"] = b"lossy"
        if cloud:
            files["meta/pointcloud.ply"] = self.cloud()
        return files

    def trajectory_files(self, episode: Episode, *, nested: bool = True, cloud: str = "meta/pointcloud.ply") -> Files:
        """Layout 3; `cloud` is the name of the cloud, empty for none."""
        files = {"data/chunk-000/episode_000000.parquet": self.table(episode, nested=nested)}
        for t, (rgb, depth) in enumerate(zip(episode.rgb, episode.depth, strict=True)):
            files[f"{RGB}/{t}.jpg"], files[f"{DEPTH}/{t}.png"] = rgb, depth
        files["meta/episodes.jsonl"] = json_lines([{"episode_index": 0, "length": len(episode.rgb)}])
        if cloud:
            files[cloud] = self.cloud()
        return files

    def write_scene_folder(self, source: Path, files: Files) -> None:
        write_files(source / GROUP / SCENE, files)

    def write_trajectories(self, source: Path, trajectories: Mapping[str, Files]) -> None:
        for name, files in trajectories.items():
            write_files(source / GROUP / SCENE / name, files)

    def write_archive(self, source: Path, files: Files) -> Path:
        path = source / GROUP / f"{SCENE}.tar.gz"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.archive({f"{SCENE}/{name}": data for name, data in files.items()}))
        return path

    def archive(self, files: Files) -> bytes:
        """A gzip tar in the order real archives have: all depth images before all colour images."""
        return gzip.compress(tar_bytes([(name, files[name]) for name in sorted(files)]), 1)


def mount_matrix(height_m: float, pitch_deg: float) -> np.ndarray:
    """Rotation about x by (90 degrees - pitch), translation z = height: the source's camera_extrinsic."""
    angle = np.deg2rad(90 - pitch_deg)
    mount = np.eye(4)
    mount[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    mount[2, 3] = height_m
    return mount


def yawed(mount: np.ndarray, yaw_rad: float, xyz_m: Iterable[float]) -> np.ndarray:
    """The mount on a robot that stands at `xyz_m`, turned by `yaw_rad` about the world's z."""
    T_world_robot = np.eye(4)
    T_world_robot[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    T_world_robot[:3, 3] = tuple(xyz_m)
    return T_world_robot @ mount


def encoded(kind: str, image: np.ndarray) -> bytes:
    return cv2.imencode(kind, image)[1].tobytes()


def json_lines(lines: list[dict[str, object]]) -> bytes:
    return "".join(json.dumps(line) + "\n" for line in lines).encode()


def write_files(root: Path, files: Files) -> None:
    for name, data in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def tar_bytes(members: list[tuple[str, bytes]]) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as tar:
        for name, data in members:
            info = tarfile.TarInfo(name)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


@pytest.fixture(scope="session")
def build() -> TreeBuilder:
    return TreeBuilder()


@pytest.fixture(scope="session")
def dataset() -> DatasetManifest:
    encoding = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0, 65535))
    return DatasetManifest(name="tiny", licence="Apache-2.0", depth=encoding)


@pytest.fixture
def scan_all(tmp_path: Path, dataset: DatasetManifest):
    """Scan every container below the test's source tree."""

    def scan(source: Path = tmp_path, depth_sample_every: int = 10) -> dict[str, ContainerScan]:
        found: list[Container] = find_containers(source, dataset)
        return {container.id: scan_container(source, container, dataset, depth_sample_every) for container in found}

    return scan


@pytest.fixture(params=["archive", "scene_folder"])
def scan_scene(request: pytest.FixtureRequest, tmp_path: Path, build: TreeBuilder, scan_all):
    """Write the files of a scene as an archive and as a folder in turn, and scan it."""

    def scan(files: Files, **options: int) -> ContainerScan:
        write = build.write_archive if request.param == "archive" else build.write_scene_folder
        write(tmp_path, files)
        (result,) = scan_all(**options).values()
        return result

    return scan
