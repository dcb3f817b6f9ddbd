"""An evaluation in its folder: what it writes, how it goes on, what it refuses."""

import json
import threading
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipelines.evaluating.nav import drive, run
from pipelines.evaluating.nav.config import NavConfig
from pipelines.evaluating.nav.run import evaluate_navigation
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.server import PlannerServer, ServerConfig
from wsm_data.planners.http.service import PlannerService
from wsm_data.planners.planner import GoalFrame
from wsm_data.planners.registry import PlannerConfig, make_planner
from wsm_data.sim.episodes import Episode, write_episodes


def evaluate(config, out, episodes=3, films=0):
    return evaluate_navigation(config, out, episodes=episodes, workers=1, films=films, quiet=True)


def outputs(out):
    return {path.name: path.read_bytes() for path in (out / "summary.json", out / "episodes.parquet")}


def home(folder, *rows):
    episodes = tuple(Episode(start_pose=np.array(row[:3]), goal_xy_m=np.array(row[3:])) for row in rows)
    write_episodes(folder / "home_1_0000" / "pointgoal_start_goal_pairs.npy", episodes)
    return str(folder)


def test_a_straight_line_through_an_empty_room_succeeds_where_the_goal_is_ahead(tmp_path, opened, make_config):
    """By the straight line, SPL is 1 for who drives it, and the robot is 4.5 m of 5 m on its way when it stops."""
    world = home(tmp_path / "world", (1.0, 2.5, 0.0, 6.0, 2.5))
    summary = evaluate(make_config(world=world), tmp_path / "out", 1)
    assert summary["success_rate"] | {"resampled": ""} == {"value": 1.0, "low": 1.0, "high": 1.0, "resampled": ""}
    assert summary["spl_straight"]["value"] == pytest.approx(1.0)
    assert summary["collision_rate"]["value"] == 0.0
    assert summary["localisation_error_m"] is None
    assert (summary["inputs"], summary["goal"], summary["controller_pose"]) == (["pose", "goal"], "fixed", "true")
    table = pq.read_table(tmp_path / "out" / "episodes.parquet").to_pylist()
    assert [(row["scene"], row["episode"], row["ending"]) for row in table] == [("home_1_0000", 0, "arrived")]


def test_each_scene_gets_a_map_and_the_first_episodes_a_film_on_request(tmp_path, opened, make_config):
    evaluate(make_config(), tmp_path, films=1)
    assert [one.name for one in (tmp_path / "episodes").iterdir()] == ["home_7_0000-000.mp4"]
    assert sorted(one.name for one in (tmp_path / "maps").iterdir()) == ["home_7_0000.png", "home_7_0001.png"]


def test_what_is_done_is_not_done_again_and_more_episodes_go_on(tmp_path, opened, make_config):
    evaluate(make_config(), tmp_path / "out", 2)
    before = outputs(tmp_path / "out")
    opened.clear()
    evaluate(make_config(), tmp_path / "out", 2)
    assert (opened, outputs(tmp_path / "out")) == ([], before)
    evaluate(make_config(), tmp_path / "out", 4)
    assert opened == ["home_7_0001"]
    evaluate(make_config(), tmp_path / "whole", 4)
    assert outputs(tmp_path / "out") == outputs(tmp_path / "whole")


def test_a_map_that_is_missing_is_drawn_without_driving_again(tmp_path, opened, make_config, monkeypatch):
    evaluate(make_config(), tmp_path, 2)
    path = tmp_path / "maps" / "home_7_0000.png"
    drawn = path.read_bytes()
    path.unlink()
    monkeypatch.delattr(drive, "run_episodes")
    evaluate(make_config(), tmp_path, 2)
    assert path.read_bytes() == drawn


def test_an_evaluation_cut_short_before_its_map_leaves_none_that_lacks_a_way(
    tmp_path, opened, make_config, monkeypatch
):
    def broken(*_):
        raise KeyboardInterrupt

    evaluate(make_config(), tmp_path / "whole", 2)
    evaluate(make_config(), tmp_path / "cut", 1)
    draw = drive.draw_paths
    monkeypatch.setattr(drive, "draw_paths", broken)
    with pytest.raises(KeyboardInterrupt):
        evaluate(make_config(), tmp_path / "cut", 2)
    monkeypatch.setattr(drive, "draw_paths", draw)
    evaluate(make_config(), tmp_path / "cut", 2)
    maps = [(tmp_path / name / "maps" / "home_7_0000.png").read_bytes() for name in ("whole", "cut")]
    assert maps[0] == maps[1]


def test_a_folder_named_as_a_generated_world_is_not_its_content(tmp_path, opened, make_config, monkeypatch):
    """The folder of the evaluation itself, most of all: it is there when the settings are compared again."""
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        evaluate(make_config(), Path("homes"), 1)
    assert json.loads(Path("homes/settings.json").read_text())["world"] == "homes"


@pytest.mark.slow
def test_two_workers_write_the_bytes_of_one(tmp_path):
    """Real homes, since nothing that a test plants here reaches another process."""
    config = NavConfig(planner="straight-line", episodes_per_scene=1, seed=7)
    for workers in (1, 2):
        evaluate_navigation(config, tmp_path / str(workers), episodes=2, workers=workers, films=0, quiet=True)
    assert outputs(tmp_path / "1") == outputs(tmp_path / "2")


@pytest.fixture
def straight_line_url():
    """A server of the straight line for goals that are given anew each time."""
    planner = make_planner("straight-line", PlannerConfig(goal=GoalFrame.CURRENT))
    server = PlannerServer(PlannerService(planner, GoalClient.POINT_GOAL), ServerConfig(host="127.0.0.1", port=0))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.url
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_planner_behind_a_url_drives_as_it_does_here(tmp_path, opened, make_config, straight_line_url):
    """The straight line looks at no picture, so what pictures lose on the way does not matter."""
    here = make_config(goal=GoalFrame.CURRENT)
    there = make_config(straight_line_url, goal=GoalFrame.CURRENT)
    evaluate(here, tmp_path / "here")
    summary = evaluate(there, tmp_path / "there")
    tables = [pq.read_table(tmp_path / side / "episodes.parquet") for side in ("here", "there")]
    for column in ("ending", "success", "driven_m", "seconds", "collisions", "plans"):
        assert tables[0][column].to_pylist() == pytest.approx(tables[1][column].to_pylist())
    assert (summary["planner"], summary["inputs"]) == ("straight-line", ["depth", "rgb", "goal"])


def test_several_workers_may_not_share_the_one_state_of_a_server(tmp_path, make_config):
    with pytest.raises(ConfigError, match="--workers must be 1 for http://nowhere, found 2"):
        evaluate_navigation(make_config("http://nowhere"), tmp_path, episodes=4, workers=2, films=0, quiet=True)


def test_an_interrupted_evaluation_ends_with_the_bytes_of_an_undisturbed_one(
    tmp_path, opened, make_config, monkeypatch
):
    whole = run.drive_scene

    def interrupted(task):
        for one in whole(task):
            yield one
            raise KeyboardInterrupt

    evaluate(make_config(), tmp_path / "whole")
    monkeypatch.setattr(run, "drive_scene", interrupted)
    with pytest.raises(KeyboardInterrupt):
        evaluate(make_config(), tmp_path / "cut")
    monkeypatch.setattr(run, "drive_scene", whole)
    evaluate(make_config(), tmp_path / "cut")
    assert outputs(tmp_path / "cut") == outputs(tmp_path / "whole")


def test_a_changed_setting_is_refused_with_both_values(tmp_path, opened, make_config):
    evaluate(make_config(), tmp_path, 1)
    with pytest.raises(ConfigError, match=r'planner: "straight-line" -> "oracle"; seed: 7 -> 8'):
        evaluate(make_config("oracle", seed=8), tmp_path, 1)


def test_changed_episodes_of_a_world_are_refused(tmp_path, opened, make_config):
    world = home(tmp_path / "world", (1.0, 2.5, 0.0, 6.0, 2.5))
    evaluate(make_config(world=world), tmp_path / "out", 1)
    home(tmp_path / "world", (1.0, 2.5, 0.0, 6.0, 2.6))
    with pytest.raises(ConfigError, match="home_1_0000"):
        evaluate(make_config(world=world), tmp_path / "out", 1)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ((0.1, 2.5, 0.0, 6.0, 2.5), "start.blocked"),
        ((1.0, 2.5, 0.0, 9.5, 2.5), "goal.unreachable"),
        ((40.0, 40.0, 0.0, 6.0, 2.5), "start.blocked"),
    ],
    ids=["a start in collision", "a goal behind a wall", "a start off the map"],
)
def test_an_episode_that_nobody_can_drive_is_refused_by_name_and_the_others_count(
    tmp_path, opened, make_config, row, reason
):
    world = home(tmp_path / "world", row, (1.0, 2.5, 0.0, 6.0, 2.5))
    summary = evaluate(make_config(world=world), tmp_path / "out", 2)
    assert summary["refused"] == {reason: 1}
    assert summary["episodes"] == 1


def test_a_folder_with_fewer_episodes_than_asked_for_is_refused(tmp_path, opened, make_config):
    world = home(tmp_path / "world", (1.0, 2.5, 0.0, 6.0, 2.5))
    with pytest.raises(ConfigError, match="must hold an episode 1, it has 1"):
        evaluate(make_config(world=world), tmp_path / "out", 2)


def test_damaged_records_are_named(tmp_path, opened, make_config):
    evaluate(make_config(), tmp_path, 1)
    path = tmp_path / "driven.jsonl"
    path.write_bytes(path.read_bytes().replace(b'"number":0', b'"number":1'))
    with pytest.raises(IntegrityError, match=r"driven\.jsonl"):
        evaluate(make_config(), tmp_path, 1)


def test_a_summary_is_what_was_returned(tmp_path, opened, make_config):
    summary = evaluate(make_config(), tmp_path, 2)
    assert json.loads((tmp_path / "summary.json").read_text()) == summary
