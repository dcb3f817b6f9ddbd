import numpy as np
import pytest

pytest.importorskip("av", reason="the extra lerobot is not installed")

from wsm_data.clips.lerobot.videos import COLOUR, DEPTH, VideoWriter
from wsm_data.readers.lerobot.video import VideoPart, decoded, depth_codes, rgb_u8


def write(path, video, pieces):
    writer = VideoWriter(path, video, (32, 16), 7)
    for piece in pieces:
        writer.add(piece)
    writer.close()
    return VideoPart(path=path, where="it", times_s=np.arange(writer.frames) / 7, tolerance_s=0.05, max_pixels=10_000)


def test_codes_of_depth_come_back_to_the_bit_over_all_pieces(tmp_path):
    codes = np.random.default_rng(0).integers(0, 4096, (5, 16, 32)).astype(np.uint16)
    part = write(tmp_path / "a" / "depth.mp4", DEPTH, [codes[:3], codes[3:]])
    assert np.array_equal(list(decoded(part, depth_codes)), codes)


def test_colour_is_close(tmp_path):
    frames = np.linspace(20, 235, 4 * 16 * 32 * 3).reshape(4, 16, 32, 3).astype(np.uint8)
    part = write(tmp_path / "rgb.mp4", COLOUR, [frames])
    assert np.abs(np.array(list(decoded(part, rgb_u8)), float) - frames).mean() < 3  # of 255; it is lossy


def test_equal_frames_give_equal_bytes(tmp_path):
    frames = np.random.default_rng(1).integers(0, 256, (4, 16, 32, 3)).astype(np.uint8)
    first, second = (write(tmp_path / name, COLOUR, [frames]).path.read_bytes() for name in ("a.mp4", "b.mp4"))
    assert first == second
