import cv2
import numpy as np
import pytest

from wsm_data.geometry.camera import unproject
from wsm_data.geometry.transform import transform_points
from wsm_data.synth.writers.recording import plan_recording, record_frames

pytestmark = pytest.mark.usefixtures("known_home")


@pytest.fixture
def recording(small, known_home):
    return plan_recording(0, "d435i", small)


def decode(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)


def test_a_camera_records_its_episodes_in_the_same_home_as_another(recording, small):
    other = plan_recording(0, "zed", small)
    assert other.home.floor_plan == recording.home.floor_plan
    assert (other.cloud.xyz_m == recording.cloud.xyz_m).all()
    assert not np.array_equal(other.episodes[0].T_world_opengl, recording.episodes[0].T_world_opengl)
    assert len(recording.episodes) == small.trajectories


def test_an_episode_does_not_depend_on_how_many_others_there_are(recording, small):
    from dataclasses import replace

    alone = plan_recording(0, "d435i", replace(small, trajectories=1))
    assert (alone.episodes[0].T_world_opengl == recording.episodes[0].T_world_opengl).all()
    assert list(record_frames(alone, 0, small)) == list(record_frames(recording, 0, small))


def test_stored_depth_lies_on_the_scene(recording, small, distance_to_mesh_m):
    frames = list(record_frames(recording, 0, small))
    for number in (0, len(frames) - 1):
        codes = decode(frames[number][1])
        points = transform_points(
            recording.episodes[0].T_world_camera[number], unproject(codes * 1e-4, recording.intrinsics)[::8, ::8]
        )
        chosen = points[codes[::8, ::8] > 0]
        assert len(chosen) > 50
        distance = distance_to_mesh_m(chosen, recording.home.mesh.points_m)
        assert distance.max() < 2e-4  # half a unit of 0.1 mm, longer along slanting rays


def test_pictures_have_the_camera_s_size_and_show_something(recording, small):
    jpeg, png = next(record_frames(recording, 1, small))
    assert decode(jpeg).shape == (68, 120, 3)
    assert decode(png).shape == (68, 120)
    assert decode(jpeg).std() > 10


def test_intrinsics_are_what_float32_holds(recording):
    assert recording.intrinsics.fx == float(np.float32(recording.intrinsics.fx))
