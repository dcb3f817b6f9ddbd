import pytest

from wsm_data.sim.config import SimConfig


def test_the_defaults_are_the_benchmark_s_camera_and_limits():
    config = SimConfig()
    camera = config.intrinsics
    assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (
        640,
        360,
        476.6,
        476.6,
        320,
        180,
    )
    assert (config.max_speed, config.camera_height_m) == (0.5, 0.3)


@pytest.mark.parametrize("wrong", [{"latency_steps": -1}, {"max_speed": 0.0}, {"camera_height_m": -0.3}])
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SimConfig(**wrong)
