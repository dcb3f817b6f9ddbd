import pytest

from wsm_data.schema.source.sequence_files import SequenceFiles


def test_the_names_are_those_of_tums_benchmark_unless_others_are_given():
    files = SequenceFiles()
    assert (files.rgb, files.depth, files.poses) == ("rgb.txt", "depth.txt", "groundtruth.txt")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"rgb": ""}, "names for its colour images"),
        ({"max_depth_lag_s": -1.0}, "max_depth_lag_s"),
        ({"max_pose_gap_s": float("inf")}, "max_pose_gap_s"),
        ({"T_tracked_camera": (1.0, 0.0)}, "16 numbers, found 2"),
    ],
)
def test_values_that_cannot_be_are_refused_by_name(wrong, said):
    with pytest.raises(ValueError, match=said):
        SequenceFiles(**wrong)
