import json

import pytest

from wsm_data.synth.config import CAMERAS
from wsm_data.synth.writers.metadata import meta_files


@pytest.fixture
def files():
    return meta_files([5, 3, 9], CAMERAS["d435i"])


def lines(content: bytes) -> list[dict]:
    return [json.loads(line) for line in content.splitlines()]


def test_the_four_meta_files_are_there(files):
    assert sorted(files) == ["meta/episodes.jsonl", "meta/episodes_stats.jsonl", "meta/info.json", "meta/tasks.jsonl"]


def test_image_indices_follow_one_another_through_the_scene(files):
    ranges = [record["image_index"] for record in lines(files["meta/episodes_stats.jsonl"])]
    assert ranges == [{"min": 0, "max": 4}, {"min": 5, "max": 7}, {"min": 8, "max": 16}]


def test_index_statistics_are_those_of_the_frame_numbers(files):
    statistics = lines(files["meta/episodes_stats.jsonl"])[1]["stats"]["index"]
    assert statistics == {"min": [5], "max": [7], "mean": [6], "std": [pytest.approx((2 / 3) ** 0.5)], "count": [3]}


def test_episodes_have_their_true_lengths_and_a_known_task(files):
    episodes, tasks = lines(files["meta/episodes.jsonl"]), lines(files["meta/tasks.jsonl"])
    assert [(record["episode_index"], record["length"]) for record in episodes] == [(0, 5), (1, 3), (2, 9)]
    assert all(record["tasks"] == [tasks[0]["task"]] for record in episodes)


def test_the_info_sums_up_the_set(files):
    info = json.loads(files["meta/info.json"])
    assert (info["codebase_version"], info["total_episodes"], info["total_frames"]) == ("v2.1", 3, 17)
    assert info["features"]["observation.images.rgb"]["shape"] == [270, 480, 3]
