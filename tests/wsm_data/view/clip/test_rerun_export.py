"""Recordings are written with rerun's SDK and read back with its reader of chunks."""

import dataclasses
import sys

import cv2
import numpy as np
import pytest
import rerun as rr
import simplejpeg
from rerun.chunk import RrdReader

from wsm_data.clips.decoded import decode_video
from wsm_data.errors import ConfigError
from wsm_data.schema.clip import Clip
from wsm_data.view.clip.rerun_export import write_rerun
from wsm_data.view.clip.text import describe_clip

FRAMES = range(9)  # of 13, the last 4 of which are padding
PINHOLE = "/world/camera/pinhole"


def read_back(path) -> dict[str, list]:
    """`entity component` to its values in the order of their frames; a component that stands still has one."""
    found = {}
    for part in RrdReader(path).stream():
        for name, values in part.to_record_batch().to_pydict().items():
            found.setdefault(f"{part.entity_path} {name}", []).extend(values)
    return found


def write(clip: Clip, codec, path):
    write_rerun(clip, codec, path)
    return path


@pytest.fixture(scope="module")
def turned(made) -> Clip:
    """A clip whose camera also turns by 0.05 rad a frame to the right, about its own y axis."""
    still = made.clip()
    poses = still.poses.copy()
    half_rad = np.minimum(np.arange(made.frames), made.frames - made.padded - 1) * 0.05 / 2
    poses[:, 3], poses[:, 5] = np.cos(half_rad), np.sin(half_rad)
    return dataclasses.replace(still, poses=poses)


@pytest.fixture(scope="module")
def recording(turned, made, tmp_path_factory) -> dict[str, list]:
    return read_back(write(turned, made.codec, tmp_path_factory.mktemp("rerun") / "clip.rrd"))


def values(recording, name, frame=0) -> np.ndarray:
    """The one value that a component holds at a frame, or at all frames."""
    (value,) = recording[name][frame]
    return np.asarray(value)


def test_a_recording_holds_the_world_the_camera_and_the_curves_and_nothing_else(recording):
    entities = {name.split()[0] for name in recording} - {"/__properties"}
    world = {"/world", "/world/map", "/world/expert_path", "/world/goal", "/world/camera"}
    assert entities == world | {
        PINHOLE,
        f"{PINHOLE}/rgb",
        f"{PINHOLE}/depth",
        "/distance/to_goal_m",
        "/distance/progress_m",
        "/about",
    }


def test_the_one_timeline_counts_the_frames_without_the_padding(recording):
    timelines = {name: frames for name, frames in recording.items() if isinstance(frames[0], int)}
    moving = ("/world/camera", f"{PINHOLE}/rgb", f"{PINHOLE}/depth", "/distance/to_goal_m")
    assert timelines == {f"{entity} frame": list(FRAMES) for entity in moving} | {
        "/distance/progress_m frame": list(FRAMES[1:])  # there is none before the first step
    }


def test_the_camera_stands_where_the_stored_pose_puts_it_in_the_world(recording, made):
    # The path is a straight line of cells; camera 0 looks along world x with x to the right (world -y), y down. After
    # 8 frames it has turned 0.4 rad to the right, so it looks along (cos 0.4, -sin 0.4, 0).
    goal_xy_m = (np.array(made.goal_cell) + made.origin_cell + 0.5) * made.resolution_m
    position_m = values(recording, "/world/camera Transform3D:translation", 8)
    np.testing.assert_allclose(position_m, [*goal_xy_m, made.camera_height_m], atol=1e-6)  # stored as float32
    right, down, forward = values(recording, "/world/camera Transform3D:mat3x3", 8).reshape(3, 3)  # rerun: by columns
    np.testing.assert_allclose(forward, [np.cos(0.4), -np.sin(0.4), 0], atol=1e-6)
    np.testing.assert_allclose(right, [-np.sin(0.4), -np.cos(0.4), 0], atol=1e-6)
    np.testing.assert_allclose(down, [0, 0, -1], atol=1e-6)


def test_the_pinhole_has_the_intrinsics_of_the_clip(recording, turned):
    matrix = values(recording, f"{PINHOLE} Pinhole:image_from_camera").reshape(3, 3).T
    np.testing.assert_array_equal(matrix, turned.intrinsics.matrix)
    assert values(recording, f"{PINHOLE} Pinhole:resolution").tolist() == [64, 32]


def test_pictures_are_what_the_latents_decode_to(recording, turned, made):
    decoded = decode_video(turned, made.codec, FRAMES)
    for frame in FRAMES:
        data = values(recording, f"{PINHOLE}/rgb EncodedImage:blob", frame).astype(np.uint8).tobytes()
        seen = simplejpeg.decode_jpeg(data).astype(int)
        assert np.abs(seen - decoded.rgb[frame]).mean() < 2  # JPEG at quality 92


def depth_m(recording, frame):
    data = values(recording, f"{PINHOLE}/depth EncodedDepthImage:blob", frame).astype(np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_UNCHANGED) / 500.0


def test_depth_is_in_metres_and_nothing_where_nothing_was_measured(recording):
    assert values(recording, f"{PINHOLE}/depth EncodedDepthImage:meter") == 500.0  # steps in a metre
    # The scene is a ramp over x from 0.5 to 4.5 m; the codec blurs, most at the border of the image.
    ramp_m = np.broadcast_to(np.linspace(0.5, 4.5, 64), (32, 64))
    first_m = depth_m(recording, 0)
    assert np.abs(first_m / ramp_m - 1)[:, 8:-8].mean() < 0.1
    assert (first_m > 0).all()
    hole_m = depth_m(recording, 3)  # cell (0, 0) of latent 1, which holds frames 1 to 4, was not measured
    assert (hole_m[:16, :16] == 0).all()
    hole_m[:16, :16] = 1
    assert (hole_m > 0).all()


def test_curves_are_the_distance_to_the_goal_and_what_a_step_takes_off_it(recording, turned):
    distance_m = [value for (value,) in recording["/distance/to_goal_m Scalars:scalars"]]
    progress_m = [value for (value,) in recording["/distance/progress_m Scalars:scalars"]]
    assert distance_m == turned.expert_distance[:9].tolist()
    np.testing.assert_allclose(distance_m[0] - np.cumsum(progress_m), distance_m[1:], atol=1e-12)


def test_the_map_lies_on_the_floor_with_each_cell_where_it_is_in_the_world(recording, turned, made):
    corners_m = np.array(recording["/world/map Mesh3D:vertex_positions"][0])
    texture_uv = np.array(recording["/world/map Mesh3D:vertex_texcoords"][0])
    rows, columns = turned.occupancy.shape
    picture = values(recording, "/world/map Mesh3D:albedo_texture_buffer").reshape(rows, columns, 3)
    low_m, high_m = corners_m[texture_uv.sum(axis=1).argmin()], corners_m[texture_uv.sum(axis=1).argmax()]
    np.testing.assert_allclose(corners_m, low_m + [1, 1, 0] * (high_m - low_m) * np.pad(texture_uv, ((0, 0), (0, 1))))
    # The cell of the goal is free and white; the pillar starts at row 25, column 20. Their places in the texture (u to
    # the right, v down from its first row), mapped to the world by the corners, must be their places in the world.
    for (column, row), colour in (((50, 20), (255, 255, 255)), ((20, 25), (0x37, 0x43, 0x4D))):
        assert tuple(picture[row, column]) == colour
        centre_m = low_m[:2] + (np.array([column, row]) + 0.5) / (columns, rows) * (high_m - low_m)[:2]
        expected_m = (np.array([column, row]) + made.origin_cell + 0.5) * made.resolution_m
        np.testing.assert_allclose(centre_m, expected_m, atol=1e-6)
    assert (corners_m[:, 2] == 0).all()  # the camera is 0.5 m above the floor and at z = 0.5 m
    assert tuple(picture[35, 55]) == (0xE6, 0xE9, 0xEC)  # unknown


def test_the_goal_is_a_closed_ring_of_its_radius_around_the_end_of_the_path(recording, turned):
    ring_m = values(recording, "/world/goal LineStrips3D:strips")
    path_m = values(recording, "/world/expert_path LineStrips3D:strips")
    np.testing.assert_allclose(path_m[-1], turned.meta.goal_world_m, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(ring_m[:, :2] - path_m[-1, :2], axis=1), 0.2, atol=1e-6)
    np.testing.assert_allclose(ring_m[0], ring_m[-1], atol=1e-6)
    assert len(path_m) == len(FRAMES)


def test_it_says_which_clip_it_is(recording, turned):
    assert values(recording, "/__properties RecordingInfo:name") == turned.meta.key
    assert describe_clip(turned) in str(values(recording, "/about TextDocument:text"))


def test_equal_clips_give_equal_content_under_one_id(recording, turned, made, tmp_path):
    again = write(turned, made.codec, tmp_path / "again.rrd")
    drawn = ("RowId", "start_time")  # by rerun, from the clock
    assert {name: value for name, value in read_back(again).items() if not name.endswith(drawn)} == {
        name: value for name, value in recording.items() if not name.endswith(drawn)
    }
    other = write(made.clip("synth_zed/home_0009/000001"), made.codec, tmp_path / "other.rrd")
    third = write(turned, made.codec, tmp_path / "third.rrd")
    assert recording_id(again) == recording_id(third) != recording_id(other)


def recording_id(path):
    from rerun.chunk import RrdReader

    (entry,) = RrdReader(path).recordings()
    return entry.recording_id


def test_a_clip_of_one_frame_has_no_progress(made, tmp_path):
    clip = made.clip()
    first = {name: getattr(clip, name)[:1] for name in ("rgb_latent", "depth_latent", "depth_valid", "poses")}
    meta = dataclasses.replace(clip.meta, frames=1, padded_frames=0)
    one = dataclasses.replace(clip, meta=meta, expert_distance=clip.expert_distance[:1], **first)
    found = read_back(write(one, made.codec, tmp_path / "one.rrd"))
    assert found["/world/camera frame"] == [0]
    assert not any("progress" in name for name in found)


def test_a_refused_clip_leaves_the_old_recording(turned, made, tmp_path):
    path = tmp_path / "clip.rrd"
    path.write_bytes(b"old")
    other = dataclasses.replace(turned, meta=dataclasses.replace(turned.meta, codec_digest="another"))
    with pytest.raises(ConfigError, match="another"):
        write(other, made.codec, path)
    assert [one.name for one in tmp_path.iterdir()] == ["clip.rrd"]
    assert path.read_bytes() == b"old"


def test_without_rerun_the_extra_is_named(turned, made, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)  # an import of it then fails as if it were not installed
    with pytest.raises(
        ConfigError, match=r"needs the package rerun; install the extra: pip install -e '\.\[viz\]' in a clone"
    ):
        write_rerun(turned, made.codec, tmp_path / "clip.rrd")


def test_rerun_switched_off_is_refused_instead_of_an_empty_recording(turned, made, tmp_path, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(ConfigError, match="RERUN"):
        write(turned, made.codec, tmp_path / "clip.rrd")
    assert not list(tmp_path.iterdir())


def test_the_strictness_of_the_caller_is_put_back(turned, made, tmp_path):
    write(turned, made.codec, tmp_path / "clip.rrd")
    assert not rr.error_utils.strict_mode()
