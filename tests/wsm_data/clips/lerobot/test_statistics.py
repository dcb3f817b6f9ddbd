import numpy as np

from wsm_data.clips.lerobot.statistics import RunningStatistics


def test_pieces_give_what_all_rows_at_once_give():
    rows = np.random.default_rng(0).normal(5, 2, (100, 3))
    statistics = RunningStatistics(3)
    for piece in (rows[:1], rows[1:40], rows[40:40], rows[40:]):
        statistics.add(piece)
    found = statistics.summary((3, 1, 1))
    for name, wanted in (("min", rows.min(0)), ("max", rows.max(0)), ("mean", rows.mean(0)), ("std", rows.std(0))):
        assert np.allclose(np.array(found[name]), wanted.reshape(3, 1, 1), rtol=1e-12)
    assert found["count"] == [100]


def test_nothing_has_no_statistics():
    assert RunningStatistics(3).summary((3,)) == {}
