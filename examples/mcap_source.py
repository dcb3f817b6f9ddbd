"""An MCAP recording as a source: `python examples/mcap_source.py RECORDING.mcap SOURCE SCENE EPISODE`.

It reads JSON messages in Foxglove's schemas: CompressedImage (colour), RawImage of `16UC1` (depth in mm), PoseInFrame
(camera in a world with z up, OpenCV axes) and CameraCalibration. For a ROS 2 bag give `make_reader` the
`DecoderFactory` of the package mcap-ros2-support in place of `JsonDecoder`, and read the fields of sensor_msgs and
geometry_msgs. Needs the package mcap.
"""

import base64
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from mcap.decoder import DecoderFactory
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from wsm_data.metrics.association import nearest_stamps
from wsm_data.readers.arrays import Frame, write_episode

COLOUR, DEPTH, POSE, CAMERA = "/camera/colour", "/camera/depth", "/camera/pose", "/camera/calibration"
MAX_LAG_S = 0.02


class JsonDecoder(DecoderFactory):
    """Messages are JSON text."""

    def decoder_for(self, message_encoding: str, schema: object) -> Callable[[bytes], Any] | None:
        """What decodes messages of this encoding, whatever their schema."""
        del schema
        return json.loads if message_encoding == "json" else None


def messages(path: Path, topic: str) -> Iterator[tuple[float, dict[str, Any]]]:
    """Time in seconds and content of every message of a topic."""
    with path.open("rb") as file:
        for _, _, message, content in make_reader(file, decoder_factories=[JsonDecoder()]).iter_decoded_messages(
            [topic]
        ):
            yield message.log_time * 1e-9, content


def frames(path: Path) -> Iterator[Frame]:
    """Colour, the depth image and the pose next to it in time; what has none of them within 20 ms is left out."""
    others = [list(messages(path, topic)) for topic in (DEPTH, POSE)]
    times_s = [np.array([time_s for time_s, _ in those]) for those in others]
    for stamp, image in messages(path, COLOUR):
        pair = [near(stamp, at, those) for at, those in zip(times_s, others, strict=True)]
        if None not in pair:
            yield colour(image), metres(pair[0]), transform(pair[1])


def near(stamp: float, times_s: np.ndarray, those: list[tuple[float, dict[str, Any]]]) -> dict[str, Any] | None:
    """The message nearest in time; None where the topic has none within 20 ms."""
    if not those:
        return None
    index = int(nearest_stamps(np.array([stamp]), times_s)[0])
    return those[index][1] if abs(times_s[index] - stamp) <= MAX_LAG_S else None


def colour(image: dict[str, Any]) -> np.ndarray:
    """uint8 [H, W, 3]."""
    data = np.frombuffer(base64.b64decode(image["data"]), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1].copy()


def metres(image: dict[str, Any]) -> np.ndarray:
    """float32 [H, W]."""
    raw = np.frombuffer(base64.b64decode(image["data"]), "<u2").reshape(image["height"], image["width"])
    return raw.astype(np.float32) / 1000


def transform(message: dict[str, Any]) -> np.ndarray:
    """Camera to world; float64 [4, 4]."""
    position, turn = message["pose"]["position"], message["pose"]["orientation"]
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat([turn[axis] for axis in "xyzw"]).as_matrix()
    T[:3, 3] = [position[axis] for axis in "xyz"]
    return T


def main(recording: str, source: str, scene: str, episode: str) -> None:
    """Write the recording as one episode."""
    _, calibration = next(messages(Path(recording), CAMERA))
    write_episode(
        Path(source), scene, episode, frames(Path(recording)), K=np.reshape(calibration["K"], (3, 3)).astype(float)
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
