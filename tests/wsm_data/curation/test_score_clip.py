import math

import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.curation.path_outline import path_outline
from wsm_data.curation.score_clip import CLIP_SCORES, score_clip, score_trajectory
from wsm_data.curation.scorers.registry import GEOMETRY_SCORERS
from wsm_data.curation.scorers.trajectory import trajectory_of


def test_a_clip_has_all_its_scores_in_the_order_of_the_columns(make_clip):
    clip = make_clip(latents=4)
    found = score_clip(clip, np.ones(48), DctCodec(), 2)
    assert list(found.values) == [one.name for one in CLIP_SCORES]
    for one in CLIP_SCORES:
        assert math.isfinite(found.values[one.name]) or one.absent, one.name
    assert math.isfinite(found.values["depth_saturated_share"])


def test_geometry_scores_are_those_of_the_trajectory_and_the_outline_is_that_of_its_path(make_clip):
    clip = make_clip(latents=4, padded_frames=3)
    trajectory = trajectory_of(clip)
    found = score_clip(clip, np.ones(48), None, 2)
    geometry = score_trajectory(trajectory, clip.meta.key)
    assert {name: found.values[name] for name in geometry} == pytest.approx(geometry, nan_ok=True)
    assert np.array_equal(found.outline_xy_m, path_outline(trajectory.path_xy_m, 32))


def test_the_floor_lies_below_the_first_camera_by_its_height(make_clip):
    T = ((1.0, 0.0, 0.0, 9.0), (0.0, 1.0, 0.0, 8.0), (0.0, 0.0, 1.0, 3.4), (0.0, 0.0, 0.0, 1.0))
    found = score_clip(make_clip(latents=4, T_world_camera0=T, camera_height_m=0.6), np.ones(48), None, 0)
    assert found.floor_z_m == pytest.approx(2.8)


def test_a_clip_whose_path_leads_through_a_wall_has_all_its_scores(hall_clip):
    values = score_clip(hall_clip(walled=True), np.ones(48), None, 0).values
    assert values["goal_reachable"] == 0.0
    assert all(math.isfinite(values[one.info.name]) or one.info.absent for one in GEOMETRY_SCORERS)


def test_without_a_codec_saturated_depth_is_absent_and_everything_else_is_the_same(make_clip):
    clip = make_clip(latents=4)
    one, other = (score_clip(clip, np.ones(48), codec, 2).values for codec in (None, DctCodec()))
    assert math.isnan(one["depth_saturated_share"])
    same = {name for name in one if name != "depth_saturated_share"}
    assert {name: one[name] for name in same} == pytest.approx({name: other[name] for name in same}, nan_ok=True)
