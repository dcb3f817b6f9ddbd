import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.choose import choose_clips
from wsm_data.curation.diversity import discrete_frechet_m
from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.quotas import Limits, Quota, QuotaConfig, column_codes, quota_table
from wsm_data.errors import ConfigError

CAMERA = st.sampled_from(["zed", "d435i"])
SCENE = st.sampled_from("abc")
FLOOR = st.sampled_from([-0.25, 0.0, 0.5, 2.75])  # 0.5 m apart is one floor, 0.75 m is not


@pytest.fixture
def choose(make_index, far_paths):
    """Chooses among clips at `scene/camera`, hardest first; returns their places and what was left out."""

    def go(places, count, config=None, within_m=0.0, read=far_paths.read):
        index = make_index(places)
        quotas = quota_table(config or QuotaConfig(), index, count)
        return choose_clips(quotas, column_codes(index["physical_scene"])[1], count, within_m, read)

    return go


def straight(starts, floors_m=None):
    """Paths of 5 m along x from each start."""
    starts = np.asarray(starts, np.float32)
    floors_m = np.zeros(len(starts), np.float32) if floors_m is None else np.asarray(floors_m, np.float32)

    def read(rows):
        paths = np.stack([starts[rows] + np.array([step, 0], np.float32) for step in range(6)], axis=1)
        return Outlines(xy_m=paths, floor_z_m=floors_m[rows])

    return read


def test_without_bounds_the_hardest_are_chosen_and_no_path_is_read(choose, far_paths):
    found = choose(["a/zed"] * 5, 3)
    assert (found.places.tolist(), found.near_duplicates, found.over_quota) == ([0, 1, 2], 0, 0)
    assert far_paths.asked == []


def test_a_full_place_is_passed_over(choose):
    found = choose(["a/zed", "a/zed", "a/zed", "b/zed", "c/zed"], 3, QuotaConfig(scene=Quota(at_most=1)))
    assert (found.places.tolist(), found.over_quota) == ([0, 3, 4], 2)


def test_places_that_must_have_clips_get_their_hardest(choose):
    places = ["a/zed"] * 4 + ["b/d435i", "b/zed", "b/d435i"]
    config = QuotaConfig(camera=Quota(named={"d435i": Limits(at_least=2)}))
    assert choose(places, 3, config).places.tolist() == [0, 4, 6]


def test_a_clip_that_two_places_wait_for_goes_first(choose):
    """With the hardest clip of each place, a then d435i, no place would be left for b."""
    places = ["a/zed", "b/zed", "c/d435i", "a/d435i", "b/d435i"]
    config = QuotaConfig(
        scene=Quota(named={"g/a": Limits(at_least=1), "g/b": Limits(at_least=1)}),
        camera=Quota(named={"d435i": Limits(at_least=2)}),
    )
    assert choose(places, 2, config).places.tolist() == [3, 4]


def test_the_hardest_of_near_duplicate_paths_of_a_scene_stands_for_them(choose):
    starts = [(0, 0), (0, 0.3), (0, 5), (0.2, 0.1), (0, 0)]
    places = ["a/zed", "a/d435i", "a/zed", "b/zed", "a/zed"]
    found = choose(places, 3, within_m=0.5, read=straight(starts))
    assert found.places.tolist() == [0, 2, 3]  # 1 runs beside 0 under another camera; 3 lies in another scene
    assert choose(places, 3, within_m=0.29, read=straight(starts)).places.tolist() == [0, 1, 2]


def test_paths_one_above_the_other_are_two_paths(choose):
    starts, floors_m = [(0, 0)] * 4, [0.0, 2.8, 0.4, 3.2]
    found = choose(["a/zed"] * 4, 2, within_m=0.5, read=straight(starts, floors_m))
    assert found.places.tolist() == [0, 1]
    with pytest.raises(ConfigError, match="2 clips are near-duplicates"):
        choose(["a/zed"] * 4, 3, within_m=0.5, read=straight(starts, floors_m))


@given(
    st.lists(st.tuples(SCENE, st.tuples(*[st.floats(-2, 2, width=16)] * 2), FLOOR), min_size=1, max_size=25),
    st.floats(0.1, 2),
)
def test_the_spatial_hash_finds_every_near_path(clips, within_m):
    """Against the walk that compares every clip with all that were chosen."""
    read = straight([start for _, start, _ in clips], [floor_m for *_, floor_m in clips])
    paths = read(np.arange(len(clips))).xy_m
    chosen = []
    for number, (scene, _, floor_m) in enumerate(clips):
        beside = [one for one in chosen if clips[one][0] == scene and abs(clips[one][2] - floor_m) <= 0.5]
        if not any(discrete_frechet_m(paths[number], paths[one]) <= within_m for one in beside):
            chosen.append(number)
    scenes = pa.array([scene for scene, *_ in clips])
    index = pa.table({"physical_scene": scenes, "group": scenes, "camera": scenes})
    quotas = quota_table(QuotaConfig(), index, len(chosen))
    codes = column_codes(index["physical_scene"])[1]
    found = choose_clips(quotas, codes, len(chosen), within_m, read)
    assert found.places.tolist() == chosen


@given(st.lists(st.tuples(SCENE, CAMERA), min_size=6, max_size=30), st.integers(1, 6), st.data())
def test_what_is_chosen_keeps_to_every_bound(clips, count, data):
    most = data.draw(st.integers(1, count))
    least = data.draw(st.integers(0, 1))
    config = QuotaConfig(scene=Quota(at_most=most), camera=Quota(at_least=least))
    scenes, cameras = zip(*clips, strict=True)
    index = pa.table({"physical_scene": pa.array(scenes), "camera": pa.array(cameras), "group": pa.array(cameras)})
    try:
        quotas = quota_table(config, index, count)
        found = choose_clips(quotas, column_codes(index["physical_scene"])[1], count, 0.0, lambda rows: rows)
    except ConfigError as error:
        assert "camera" in str(error) or "scene" in str(error)  # noqa: PT017
        return
    taken = [clips[place] for place in found.places]
    assert len(taken) == count
    assert all(sum(scene == one for scene, _ in taken) <= most for one in "abc")
    assert all(sum(camera == one for _, camera in taken) >= least for one in {camera for _, camera in clips})


def test_paths_are_read_only_as_far_as_the_walk_comes(choose, far_paths, monkeypatch):
    monkeypatch.setattr("wsm_data.curation.choose._LEAST_BLOCK", 4)
    choose(["a/zed"] * 100, 3, within_m=1.0)
    assert far_paths.asked == [0, 1, 2, 3]


def test_blocks_do_not_change_what_is_chosen(choose, monkeypatch):
    starts = np.random.default_rng(0).uniform(0, 3, (60, 2))
    places = [f"{scene}/{camera}" for scene in "abc" for camera in ("zed", "d435i")] * 10
    config = QuotaConfig(scene=Quota(at_most=0.5), camera=Quota(at_least=0.4))
    whole = choose(places, 10, config, within_m=0.3, read=straight(starts))
    monkeypatch.setattr("wsm_data.curation.choose._LEAST_BLOCK", 1)
    pieces = choose(places, 10, config, within_m=0.3, read=straight(starts))
    assert pieces.places.tolist() == whole.places.tolist()


def test_too_many_near_duplicates_are_refused_with_their_number(choose):
    with pytest.raises(ConfigError, match=r"3 clips .* only 1 can be: 4 clips are near-duplicates.*within_m = 0.5"):
        choose(["a/zed"] * 5, 3, within_m=0.5, read=straight([(0, 0)] * 5))


def test_quotas_that_leave_too_few_are_refused_by_their_name(choose):
    config = QuotaConfig(
        scene=Quota(named={"g/a": Limits(at_most=1)}), camera=Quota(named={"d435i": Limits(at_most=1)})
    )
    with pytest.raises(ConfigError, match=r"4 clips .* only 3 can be: 2 are over the quota of .*scene g/a"):
        choose(["a/zed", "a/zed", "b/d435i", "b/d435i", "b/zed"], 4, config)


def test_a_bound_that_near_duplicates_break_is_refused_by_its_name(choose):
    config = QuotaConfig(camera=Quota(named={"d435i": Limits(at_least=2)}))
    with pytest.raises(ConfigError, match=r"camera d435i cannot be met: at least 2 clips .* 1 could be taken"):
        choose(["a/d435i", "a/d435i", "a/zed"], 2, config, within_m=1.0, read=straight([(0, 0), (0, 0), (9, 9)]))
