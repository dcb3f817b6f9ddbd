import pytest

from wsm_data.schema.source.lerobot_features import LerobotFeatures


def test_depth_and_intrinsics_may_be_left_out_and_colour_and_pose_may_not():
    assert LerobotFeatures().depth == ""
    for name in ("rgb", "pose"):
        with pytest.raises(ValueError, match="must have names"):
            LerobotFeatures(**{name: ""})


@pytest.mark.parametrize("camera", ["", "my_camera"])
def test_a_camera_is_a_word_without_underscore(camera):
    with pytest.raises(ValueError, match="name of a camera"):
        LerobotFeatures(camera=camera)
