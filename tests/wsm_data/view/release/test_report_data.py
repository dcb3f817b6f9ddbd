import pytest

from wsm_data.view.release.report_data import StageSummary, covered_seconds


@pytest.mark.parametrize(("done", "seconds", "rate"), [(7, 2.0, 3.5), (0, 4.0, 0.0), (3, 0.0, None)])
def test_the_rate_of_a_stage_needs_a_time(done, seconds, rate):
    summary = StageSummary(
        name="map", version=1, units=9, done=done, refused=0, seconds=9.0, wall_seconds=seconds, workers=1
    )
    assert summary.done_per_s == rate


def test_time_on_the_wall_counts_what_overlaps_once_and_pauses_not_at_all():
    two_workers = [(0.0, 4.0), (1.0, 3.0), (3.5, 6.0)]  # 0 to 6
    assert covered_seconds([(100.0, 101.5), *two_workers]) == 7.5
    assert covered_seconds([]) == 0.0
