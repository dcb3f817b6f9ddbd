"""The example that turns an MCAP recording into a source runs on one, and gives back what was recorded."""

import base64
import json
import runpy
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wsm_data.readers.array_episodes import ARRAYS
from wsm_data.readers.manifest import load_dataset

EXAMPLE = Path(__file__).parents[2] / "examples" / "mcap_source.py"
K = [[24.0, 0.0, 15.5], [0.0, 24.0, 11.5], [0.0, 0.0, 1.0]]


def recorded(path, frames):
    """10 Hz; depth 5 ms late, poses 3 ms early, and no depth for the third image."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = {
            topic: writer.register_channel(topic, "json", writer.register_schema(name, "jsonschema", b"{}"))
            for topic, name in (
                ("/camera/colour", "foxglove.CompressedImage"),
                ("/camera/depth", "foxglove.RawImage"),
                ("/camera/pose", "foxglove.PoseInFrame"),
                ("/camera/calibration", "foxglove.CameraCalibration"),
            )
        }

        def write(topic, stamp_s, content):
            stamp_ns = round(stamp_s * 1e9)
            writer.add_message(channels[topic], stamp_ns, json.dumps(content).encode(), stamp_ns)

        write("/camera/calibration", 100.0, {"K": np.ravel(K).tolist()})
        for number, (rgb, raw, T) in enumerate(frames):
            stamp = 100 + number / 10
            png = cv2.imencode(".png", rgb[..., ::-1])[1].tobytes()
            write("/camera/colour", stamp, {"format": "png", "data": base64.b64encode(png).decode()})
            if number != 2:
                depth = {
                    "encoding": "16UC1",
                    "height": 24,
                    "width": 32,
                    "data": base64.b64encode(raw.tobytes()).decode(),
                }
                write("/camera/depth", stamp + 0.005, depth)
            turn = dict(zip("xyzw", Rotation.from_matrix(T[:3, :3]).as_quat().tolist(), strict=True))
            place = dict(zip("xyz", T[:3, 3].tolist(), strict=True))
            write("/camera/pose", stamp - 0.003, {"pose": {"position": place, "orientation": turn}})
        writer.finish()


def test_a_recording_becomes_an_episode_of_its_images_depth_and_poses(tmp_path, monkeypatch):
    pytest.importorskip("mcap", reason="the package mcap is not installed")
    rng = np.random.default_rng(0)
    frames = []
    for number in range(6):
        T = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0.1 * number], [0, -1, 0, 0.8], [0, 0, 0, 1]])
        frames.append((rng.integers(0, 256, (24, 32, 3), np.uint8), rng.integers(500, 4000, (24, 32), np.uint16), T))
    recorded(tmp_path / "walk.mcap", frames)
    words = [str(tmp_path / "walk.mcap"), str(tmp_path / "source"), "lab", "walk"]
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), *words])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    dataset = load_dataset("arrays")
    (container,) = ARRAYS.find_containers(tmp_path / "source", dataset)
    folder = tmp_path / "source" / "lab" / "walk"
    stored = np.reshape(json.loads((folder / "episode.json").read_text())["T_world_camera"], (-1, 4, 4))
    kept = [frame for number, frame in enumerate(frames) if number != 2]
    assert np.abs(stored - np.array([T for _, _, T in kept])).max() < 1e-12
    for number, (rgb, raw, _) in enumerate(kept):
        assert np.array_equal(cv2.imread(str(folder / "rgb" / f"{number:06d}.png"))[..., ::-1], rgb)
        codes = cv2.imread(str(folder / "depth" / f"{number:06d}.png"), cv2.IMREAD_UNCHANGED)
        assert np.abs(codes * 1e-4 - raw / 1000).max() < 0.51e-4
    assert container.id == "lab"
