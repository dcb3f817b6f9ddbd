from wsm_data.checks.length import check_length
from wsm_data.errors import Reason


def test_a_trajectory_of_four_frames_is_too_short_and_one_of_five_is_not(make_record):
    assert check_length(make_record(frames=4), 5).reason is Reason.EPISODE_TOO_SHORT
    assert check_length(make_record(frames=5), 5).keep
    assert check_length(make_record(frames=4), 5).measured == {"frames": 4}
