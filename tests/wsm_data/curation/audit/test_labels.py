from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from wsm_data.curation.audit.clip_labels import ClipLabels
from wsm_data.curation.audit.finding import Severity
from wsm_data.curation.audit.labels import distance_conflicts, map_conflicts, near_duplicates_across_splits


def labels(number, *, y_m=0.0, split="train", camera="zed", scene="home", floor_m=0.0, distance_m=9.8, **changes):
    """A clip that goes 10 m along x."""
    row = SimpleNamespace(
        key=f"g_{camera}/{scene}/{number}", split=split, camera=camera, group=f"g_{camera}", scene=scene,
        physical_scene=f"g/{scene}",
    )  # fmt: skip
    outline = np.stack([np.linspace(0, 10, 32), np.full(32, y_m)], axis=1)
    one = ClipLabels(
        row=row,
        outline_xy_m=outline,
        start_m=np.array([*outline[0], floor_m]),
        goal_m=np.array([*outline[-1], floor_m]),
        expert_distance_m=distance_m,
        robot_radius_m=0.25,
        map_digest="m1",
    )
    return replace(one, **changes)


def test_a_held_out_path_beside_a_training_path_is_found_with_the_nearest():
    clips = [labels(1), labels(2, y_m=0.6), labels(3, y_m=0.4, split="test"), labels(4, y_m=5, split="test")]
    [found] = near_duplicates_across_splits(clips, 0.5)
    assert found.clips == ("g_zed/home/3", "g_zed/home/2")
    assert found.severity is Severity.WARNING
    assert "runs within 0.20 m" in found.message
    assert "(camera zed)" in found.message


def test_near_paths_are_found_across_the_cameras_of_one_physical_scene():
    [found] = near_duplicates_across_splits([labels(1), labels(2, camera="d435i", y_m=0.4, split="test")], 0.5)
    assert "across cameras d435i and zed" in found.message
    assert found.severity is Severity.ERROR


@pytest.mark.parametrize(("y_m", "severity"), [(0.0, Severity.ERROR), (0.09, Severity.ERROR), (0.11, Severity.WARNING)])
def test_one_path_driven_twice_is_an_error_and_one_beside_it_a_warning(y_m, severity):
    [found] = near_duplicates_across_splits([labels(1), labels(2, y_m=y_m, split="test")], 0.5)
    assert found.severity is severity


def test_a_clip_is_named_once_with_the_worst_of_its_neighbours():
    clips = [labels(1), labels(2, y_m=0.2), labels(3, camera="d435i", y_m=0.6), labels(4, y_m=0.3, split="test")]
    [found] = near_duplicates_across_splits(clips, 0.5)
    assert (found.severity, found.clips[1]) == (Severity.ERROR, "g_d435i/home/3")


@pytest.mark.parametrize("other", [{"scene": "other"}, {"floor_m": 3.0}, {"split": "test"}])
def test_paths_of_other_scenes_floors_and_the_same_split_are_no_leak(other):
    clips = [labels(1, **other), labels(2, split="test")]
    assert list(near_duplicates_across_splits(clips, 0.5)) == []


def test_different_distances_of_the_same_start_and_goal_of_one_robot_are_an_error():
    clips = [labels(1), labels(2, distance_m=9.8 + 0.24), labels(3, distance_m=12.0, y_m=0.05)]
    found = list(distance_conflicts(clips, 0.1, 0.25))
    assert [(one.severity, one.clips) for one in found] == [
        (Severity.ERROR, ("g_zed/home/1", "g_zed/home/3")),
        (Severity.ERROR, ("g_zed/home/2", "g_zed/home/3")),
    ]
    assert "9.80 m apart in the first, and 12.00 m in the second, for the same robot" in found[0].message


def test_between_robots_it_is_a_warning_that_names_them():
    clips = [labels(1), labels(2, camera="d435i", distance_m=12.0, robot_radius_m=0.3)]
    [found] = distance_conflicts(clips, 0.1, 0.25)
    assert found.severity is Severity.WARNING
    assert "d435i of radius 0.3 m and zed of radius 0.25 m" in found.message


@pytest.mark.parametrize("other", [{"y_m": 0.2}, {"scene": "other"}, {"floor_m": 3.0}])
def test_distances_from_other_places_may_differ(other):
    assert list(distance_conflicts([labels(1), labels(2, distance_m=12.0, **other)], 0.1, 0.25)) == []


def test_distances_may_differ_by_as_much_as_the_places_do():
    clips = [labels(1), labels(2, y_m=0.09, distance_m=9.8 + 0.25 + 0.17)]
    assert list(distance_conflicts(clips, 0.1, 0.25)) == []


def test_one_floor_of_a_scene_on_two_maps_is_a_warning():
    clips = [labels(1), labels(2), labels(3, map_digest="m2"), labels(4, floor_m=3.0, map_digest="m3")]
    [found] = map_conflicts(clips)
    assert found.severity is Severity.WARNING
    assert "g_zed/home on the floor at 0.00 m were labelled on 2 maps: 2 on m1, 1 on m2" in found.message


def test_two_cameras_of_a_scene_have_maps_of_their_own():
    assert list(map_conflicts([labels(1), labels(2, camera="d435i", map_digest="m2")])) == []
