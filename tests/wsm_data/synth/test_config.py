import pytest

from wsm_data.synth.config import CAMERAS, SynthConfig


def test_the_d435i_has_the_published_intrinsics():
    camera = CAMERAS["d435i"]
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (355.81, 351.69, 240, 135)
    assert (camera.width, camera.height) == (480, 270)


def test_groups_and_scenes_are_named_alike_under_every_camera():
    config = SynthConfig()
    assert config.group("zed") == "synth_zed"
    assert config.scene_name(0) == "home_0001"


def test_scaled_images_have_scaled_intrinsics():
    small = SynthConfig(image_scale=0.25).intrinsics("zed")
    assert (small.width, small.height, small.fx) == (160, 90, pytest.approx(476.6 / 4))
    assert SynthConfig().intrinsics("zed") == CAMERAS["zed"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"cameras": ("d435i", "kinect")}, "cameras must be of"),
        ({"scenes": 0}, "scenes must be at least 1"),
        ({"trajectories": 0}, "trajectories must be at least 1"),
        ({"min_frames": 50, "max_frames": 40}, "min_frames <= max_frames"),
        ({"max_frames": 1000}, "max_frames"),  # frame numbers have three digits
        ({"min_step_m": 0.0}, "min_step_m"),
        ({"max_camera_height_m": 2.5}, "max_camera_height_m"),
        ({"image_scale": 0.0}, "image_scale"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_before_any_work(wrong, message):
    with pytest.raises(ValueError, match=message):
        SynthConfig(**wrong)
