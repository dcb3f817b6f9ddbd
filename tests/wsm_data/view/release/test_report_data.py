import pytest

from wsm_data.view.release.report_data import StageSummary


@pytest.mark.parametrize(("done", "seconds", "rate"), [(7, 2.0, 3.5), (0, 4.0, 0.0), (3, 0.0, None)])
def test_the_rate_of_a_stage_needs_a_time(done, seconds, rate):
    summary = StageSummary(name="map", version=1, units=9, done=done, refused=0, seconds=seconds, workers=1)
    assert summary.done_per_s == rate
