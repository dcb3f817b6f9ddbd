import json
from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import ConfigError, Reason
from wsm_data.readers.array_episodes import ARRAYS
from wsm_data.readers.arrays import EPISODE_FILE, write_episode
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.source.motion import Motion

K = np.array([[24.0, 0, 15.5], [0, 24.5, 11.5], [0, 0, 1]])
LEVEL = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0.8], [0, 0, 0, 1]])  # looks along y


@pytest.fixture(scope="module")
def dataset():
    return replace(load_dataset("arrays"), motion=Motion(carried_by="hand"))


def frames(count=6, seed=0):
    rng = np.random.default_rng(seed)
    for i in range(count):
        T = LEVEL.copy()
        T[1, 3] = 0.1 * i
        yield rng.integers(0, 256, (24, 32, 3), np.uint8), rng.uniform(1, 3, (24, 32)).astype(np.float32), T


def scan(source, dataset):
    (container,) = ARRAYS.find_containers(source, dataset)
    return container, ARRAYS.scan(source, container, dataset, 2)


def test_what_was_written_comes_back_equal(tmp_path, dataset):
    for number, name in enumerate(("one", "two")):
        write_episode(tmp_path, "kitchen", name, frames(seed=number), K=K, camera="cam", floor_z_m=0.1)
    container, found = scan(tmp_path, dataset)
    assert [record.id.text for record in found.records] == ["arrays_cam/kitchen/one", "arrays_cam/kitchen/two"]
    record = found.records[1]
    assert np.array_equal(record.T_world_camera, np.stack([T for _, _, T in frames()]))
    assert np.array_equal(record.intrinsics.matrix, K)
    assert record.camera_height_m == pytest.approx(0.7)
    given = ARRAYS.iter_frames(tmp_path, container, dataset, found.records)
    read = {one.id.episode: images for one, images in given}
    assert read["one"].rgb[3] == (tmp_path / "kitchen" / "one" / "rgb" / "000003.png").read_bytes()


def test_thinning_and_cutting_are_those_of_the_manifest(tmp_path, dataset):
    write_episode(tmp_path, "kitchen", "one", frames(9), K=K, floor_z_m=0.0)
    cut = replace(dataset, motion=Motion(carried_by="hand", min_step_m=0.15, max_frames=3))
    _, found = scan(tmp_path, cut)
    assert [record.id.episode for record in found.records] == ["one_000000", "one_000001"]
    assert np.concatenate([one.T_world_camera[:, 1, 3] for one in found.records]) == pytest.approx(
        [0, 0.2, 0.4, 0.6, 0.8]
    )


def test_a_stated_goal_is_that_of_the_last_piece_and_earlier_pieces_lead_to_where_they_end(tmp_path, dataset):
    goal = (0.05, 0.75, 0.8)
    write_episode(tmp_path, "kitchen", "one", frames(8), K=K, floor_z_m=0.0, goal_world_m=goal)
    _, found = scan(tmp_path, replace(dataset, motion=Motion(carried_by="hand", max_frames=4)))
    first, last = found.records
    assert (first.goal_world_m, last.goal_world_m) == (None, goal)
    assert first.goal_m.tolist() == first.T_world_camera[-1, :3, 3].tolist()
    assert last.goal_m.tolist() == list(goal)


def test_an_episode_without_depth_gives_records_without_depth(tmp_path, dataset):
    bare = [(rgb, None, T) for rgb, _, T in frames()]
    write_episode(tmp_path, "kitchen", "one", bare, K=K, floor_z_m=0.0)
    container, found = scan(tmp_path, dataset)
    (record,) = found.records
    assert not record.has_depth
    ((_, images),) = ARRAYS.iter_frames(tmp_path, container, dataset, found.records)
    assert set(images.depth) == {None}


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("floor_z_m", float("nan"), Reason.SEQUENCE_UNREADABLE),
        ("goal_world_m", [0.0, float("inf"), 0.0], Reason.SEQUENCE_UNREADABLE),
        ("goal_world_m", [0.0], Reason.SEQUENCE_UNREADABLE),
        ("T_world_camera", [], Reason.SEQUENCE_UNREADABLE),
        ("T_world_camera", [[2.0] * 16] * 6, Reason.POSE_NOT_RIGID),
    ],
)
def test_values_that_cannot_be_are_a_refusal_of_their_episode(tmp_path, dataset, name, value, reason):
    folder = write_episode(tmp_path, "kitchen", "one", frames(), K=K, floor_z_m=0.0)
    said = json.loads((folder / EPISODE_FILE).read_text())
    (folder / EPISODE_FILE).write_text(json.dumps({**said, name: value}))
    _, found = scan(tmp_path, dataset)
    assert [one.reason for one in found.refusals] == [reason]


@pytest.mark.parametrize("name", ["camera", "K", "depth", "floor_z_m", "goal_world_m", "T_world_camera"])
def test_a_value_that_is_missing_is_a_refusal_of_its_episode(tmp_path, dataset, name):
    folder = write_episode(tmp_path, "kitchen", "one", frames(), K=K, floor_z_m=0.0)
    said = json.loads((folder / EPISODE_FILE).read_text())
    del said[name]
    (folder / EPISODE_FILE).write_text(json.dumps(said))
    _, found = scan(tmp_path, dataset)
    assert [one.reason for one in found.refusals] == [Reason.SEQUENCE_UNREADABLE]


@pytest.mark.parametrize("damage", ["{", "{}", '{"T_world_camera": [1], "K": 2}'])
def test_a_damaged_episode_is_refused_and_the_other_goes_on(tmp_path, dataset, damage):
    for name in ("one", "two"):
        write_episode(tmp_path, "kitchen", name, frames(), K=K, floor_z_m=0.0)
    (tmp_path / "kitchen" / "one" / EPISODE_FILE).write_text(damage)
    _, found = scan(tmp_path, dataset)
    assert [(one.unit, one.reason) for one in found.refusals] == [("arrays/kitchen/one", Reason.SEQUENCE_UNREADABLE)]
    assert [record.id.episode for record in found.records] == ["two"]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"camera": ["cam"]}, Reason.SEQUENCE_UNREADABLE),
        ({"camera": "\x1b[2J"}, Reason.SEQUENCE_UNREADABLE),
        ({"camera": "a/b"}, Reason.SEQUENCE_UNREADABLE),
        ({"camera": "my_cam"}, Reason.SEQUENCE_UNREADABLE),
        ({"camera": ""}, Reason.SEQUENCE_UNREADABLE),
        ({"T_world_camera": [[float("nan")] * 16] * 6}, Reason.POSE_NOT_FINITE),
    ],
)
def test_a_camera_that_is_no_name_and_poses_that_are_no_numbers_are_refused(tmp_path, dataset, changes, reason):
    folder = write_episode(tmp_path, "kitchen", "one", frames(), K=K, floor_z_m=0.0)
    said = json.loads((folder / EPISODE_FILE).read_text())
    (folder / EPISODE_FILE).write_text(json.dumps({**said, **changes}))
    _, found = scan(tmp_path, dataset)
    assert ([one.reason for one in found.refusals], found.records) == ([reason], ())


def test_more_poses_than_images_are_a_missing_file(tmp_path, dataset):
    folder = write_episode(tmp_path, "kitchen", "one", frames(), K=K, floor_z_m=0.0)
    said = json.loads((folder / EPISODE_FILE).read_text())
    said["T_world_camera"].append(said["T_world_camera"][-1])
    (folder / EPISODE_FILE).write_text(json.dumps(said))
    _, found = scan(tmp_path, dataset)
    assert [one.reason for one in found.refusals] == [Reason.FILE_UNREADABLE]


def test_a_source_without_an_episode_says_what_was_looked_for(tmp_path, dataset):
    with pytest.raises(ConfigError, match=r"<scene>/<episode>/episode\.json"):
        ARRAYS.find_containers(tmp_path, dataset)
