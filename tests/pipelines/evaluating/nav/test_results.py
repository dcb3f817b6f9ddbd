"""Means of planted episodes, worked out by hand."""

from dataclasses import replace

import pytest

from pipelines.evaluating.nav.drive import Driven
from pipelines.evaluating.nav.results import summarise
from wsm_data.sim.result import EpisodeResult
from wsm_data.sim.rules import Ending

RESULT = EpisodeResult(
    scene="a", episode=0, planner="p", ending=Ending.ARRIVED, success=True, spl_geodesic=0.9, spl_straight=0.8,
    straight_m=4.0, geodesic_m=5.0, driven_m=5.5, seconds=15.0, navigation_error_m=0.2, localisation_error_m=0.5,
    ate_rmse_unaligned_m=None, collisions=0, near_misses=0, plans=9,
)  # fmt: skip
FAILED = replace(
    RESULT,
    ending=Ending.STUCK,
    success=False,
    spl_geodesic=0.0,
    spl_straight=0.0,
    collisions=3,
    localisation_error_m=None,
)


def driven(scene, number, result):
    return Driven(scene=scene, number=number, result=replace(result, scene=scene, episode=number), senses=("rgb",))


def test_scenes_count_alike_however_many_episodes_they_have(make_config):
    """Scene a has 1 of 1, scene b 1 of 4: the mean of scenes is 0.625, that of episodes would be 0.4."""
    found = [driven("a", 0, RESULT), driven("b", 0, RESULT), *(driven("b", n, FAILED) for n in (1, 2, 3))]
    refused = Driven(scene="b", number=4, reason="start.blocked", message="m")
    summary = summarise([*found, refused], make_config())
    assert summary["success_rate"]["value"] == pytest.approx(0.625)
    assert summary["spl_geodesic"]["value"] == pytest.approx((0.9 + 0.225) / 2)
    assert summary["collision_rate"]["value"] == pytest.approx(0.375)
    assert summary["success_rate"]["low"] == pytest.approx(0.25)
    assert summary["success_rate"]["resampled"] == "scenes"
    assert summary["localisation_error_m"]["value"] == 0.5
    assert summary["ate_rmse_unaligned_m"] is None
    assert summary["endings"] == {"arrived": 2, "stuck": 3}
    assert (summary["scenes"], summary["episodes"], summary["refused"]) == (2, 5, {"start.blocked": 1})
    assert summary["inputs"] == ["rgb", "goal"]
