import pytest

from wsm_data.schema.source.motion import CarriedBy, Motion


def test_by_default_a_robot_carries_the_camera_and_every_frame_is_kept():
    assert Motion() == Motion(carried_by=CarriedBy.ROBOT, floor_z_m=None, min_step_m=0, min_turn_deg=0, max_frames=0)


@pytest.mark.parametrize("wrong", [{"min_step_m": -0.1}, {"min_turn_deg": float("nan")}, {"max_frames": -1}])
def test_negative_and_infinite_values_are_refused_by_name(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Motion(**wrong)
