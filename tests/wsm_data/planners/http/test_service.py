"""What a planner sees of requests, and what becomes of its answers."""

import json

import numpy as np
import pytest

from wsm_data.errors import ConfigError
from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.service import GOAL_FRAMES, PlannerService, require_servable
from wsm_data.planners.http.wire import encode_depth, encode_goals, encode_image
from wsm_data.planners.planner import GoalFrame, Plan, Sense
from wsm_data.planners.registry import PLANNER_NAMES, PlannerConfig, make_planner

MATRIX = [[30.0, 0, 16.0], [0, 30.0, 8.0], [0, 0, 1]]


@pytest.fixture
def form(red_left):
    def make(batch=1, depth_m=2.0, rows=16):
        return {
            "image": encode_image(red_left(batch)[:, :rows]),
            "depth": encode_depth(np.full((batch, rows, 32), depth_m, np.float32)),
            "goal_data": encode_goals(np.tile([3.0, -1.0], (batch, 1))).encode(),
        }

    return make


def started(planner, client=GoalClient.POINT_GOAL, batch=1):
    service = PlannerService(planner, client)
    service.reset({"intrinsic": MATRIX, "stop_threshold": -3.0, "batch_size": batch})
    return service


def fault_of(call):
    with pytest.raises(WireError) as refused:
        call()
    return refused.value.fault


def test_the_planner_is_reset_with_the_size_of_the_first_pictures(recording, form):
    started(recording, batch=2).point_goal_step(form(2))
    ((intrinsics, environments),) = recording.resets
    assert (intrinsics.fx, intrinsics.cx, intrinsics.width, intrinsics.height) == (30.0, 16.0, 32, 16)
    assert environments == 2


def test_the_farthest_code_measures_nothing(recording, form):
    service = started(recording)
    service.point_goal_step(form(depth_m=np.inf))
    service.point_goal_step(form(depth_m=6.5))
    assert [seen[0].depth_m.max() for seen in recording.seen] == [0.0, np.float32(6.5)]


def test_a_planner_sees_what_it_declares_and_no_more(make_recording, form):
    planner = make_recording(frozenset({Sense.RGB}))
    started(planner).point_goal_step(form())
    assert planner.seen[0][0].rgb_u8.shape == (16, 32, 3)
    assert planner.seen[0][0].depth_m is None


def test_goals_of_start_goal_clients_stand_in_the_start_frame(recording, form):
    for client in GoalClient:
        started(recording, client).point_goal_step(form())
    assert [seen[0].goal_frame for seen in recording.seen] == [GoalFrame.START, GoalFrame.CURRENT]


def test_a_goal_without_estimate_stands_where_the_believed_pose_puts_it(recording, form):
    recording.answers = lambda number, seen: Plan(path_m=np.zeros((2, 2)), pose_estimate=np.array([1.0, 0, np.pi / 2]))
    record = json.loads(started(recording, GoalClient.START_GOAL).point_goal_step(form()))
    np.testing.assert_allclose(record["sub_pointgoal_pd"], [[-1.0, -2.0, 0.0]], atol=1e-12)  # (3, -1) seen from there


def test_each_environment_counts_its_own_steps(recording, form):
    service = started(recording, batch=2)
    service.point_goal_step(form(2))
    service.reset_environment({"env_id": 1})
    service.point_goal_step(form(2))
    assert recording.resets[1:] == [1]
    assert [seen.step for seen in recording.seen[1].values()] == [1, 0]


def test_a_planner_that_keeps_its_path_answers_without_one(recording, form):
    recording.answers = lambda number, seen: None
    assert json.loads(started(recording).point_goal_step(form())) == {"keep": True}


def test_beside_others_an_environment_that_keeps_its_path_is_sent_it_again(recording, form):
    recording.answers = lambda number, seen: (
        None if number and seen.step else Plan(path_m=np.full((2, 2), float(seen.step)))
    )
    service = started(recording, batch=2)
    service.point_goal_step(form(2))
    record = json.loads(service.point_goal_step(form(2)))
    assert [np.max(path) for path in record["trajectory"]] == [1.0, 0.0]


def test_pictures_of_another_size_are_refused_until_the_next_reset(recording, form):
    service = started(recording)
    service.point_goal_step(form())
    assert fault_of(lambda: service.point_goal_step(form(rows=12))) is Fault.WRONG_BATCH
    assert len(recording.seen) == 1


def test_a_batch_of_another_size_is_refused_and_no_step_is_counted(recording, form):
    service = started(recording, batch=4)
    assert fault_of(lambda: service.point_goal_step(form(2))) is Fault.WRONG_BATCH
    service.point_goal_step(form(4))
    assert [seen.step for seen in recording.seen[0].values()] == [0] * 4


def test_a_step_before_a_reset_is_out_of_turn(recording, form):
    service = PlannerService(recording, GoalClient.POINT_GOAL)
    assert fault_of(lambda: service.point_goal_step(form())) is Fault.OUT_OF_TURN
    assert fault_of(lambda: service.reset_environment({"env_id": 0})) is Fault.OUT_OF_TURN


@pytest.mark.parametrize(
    "record",
    [
        {"intrinsic": MATRIX},
        {"batch_size": 1},
        {"intrinsic": MATRIX, "batch_size": 0},
        {"intrinsic": MATRIX, "batch_size": True},
        {"intrinsic": MATRIX, "batch_size": 10**9},
        {"intrinsic": MATRIX[:2], "batch_size": 1},
    ],
)
def test_resets_that_say_too_little_or_too_much_are_refused(recording, record):
    service = PlannerService(recording, GoalClient.POINT_GOAL)
    fault_of(lambda: service.reset(record))
    assert service.environments == 0


def test_an_environment_that_there_is_not_is_of_a_wrong_batch(recording):
    service = started(recording, batch=2)
    assert fault_of(lambda: service.reset_environment({"env_id": 2})) is Fault.WRONG_BATCH


@pytest.mark.parametrize("name", ["image", "depth", "goal_data"])
def test_a_form_without_one_of_its_parts_is_malformed(recording, form, name):
    parts = form()
    del parts[name]
    assert fault_of(lambda: started(recording).point_goal_step(parts)) is Fault.MALFORMED


@pytest.mark.parametrize("error", [ValueError("no depth"), ConfigError("no weights")])
def test_a_planner_that_fails_is_named(recording, form, error):
    def fail(number, seen):
        raise error

    recording.answers = fail
    assert fault_of(lambda: started(recording).point_goal_step(form())) is Fault.PLANNER


def test_a_matrix_that_does_not_fit_the_picture_is_named(recording, form):
    service = PlannerService(recording, GoalClient.POINT_GOAL)
    service.reset({"intrinsic": [[30.0, 0, 160.0], [0, 30.0, 8.0], [0, 0, 1]], "batch_size": 1})
    assert fault_of(lambda: service.point_goal_step(form())) is Fault.PLANNER


@pytest.mark.parametrize(
    ("name", "client"),
    [(name, GoalClient.POINT_GOAL) for name in ("straight-line", "reactive", "map-and-plan-estimated")]
    + [("map-and-plan-estimated", GoalClient.START_GOAL)],
)
def test_each_planner_that_is_served_answers_step_after_step(form, name, client):
    """Nothing is seen within 5 m, and the goal lies 0.32 rad to the right: the answer is a path that leads there."""
    planner = make_planner(name, PlannerConfig(goal=GOAL_FRAMES[client]))
    require_servable(planner)
    service = started(planner, client)
    for _ in range(2):
        path = np.array(json.loads(service.point_goal_step(form(depth_m=np.inf)))["trajectory"][0])
    assert path[-1, 0] > 1.0
    assert path[-1, 1] / path[-1, 0] == pytest.approx(-1 / 3, abs=0.02)


def test_which_built_in_planners_can_be_served_to_whom():
    def is_servable(name, client):
        try:
            require_servable(make_planner(name, PlannerConfig(goal=GOAL_FRAMES[client])))
        except ConfigError:
            return False
        return True

    servable = {client: [name for name in PLANNER_NAMES if is_servable(name, client)] for client in GoalClient}
    assert servable[GoalClient.START_GOAL] == ["map-and-plan-estimated"]
    assert servable[GoalClient.POINT_GOAL] == ["straight-line", "reactive", "map-and-plan-estimated"]
