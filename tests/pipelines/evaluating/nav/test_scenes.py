import numpy as np
import pytest

from pipelines.evaluating.nav.scenes import list_scenes
from wsm_data.errors import ConfigError
from wsm_data.sim.episodes import Episode, write_episodes


def listed(config, episodes):
    return [(scene.name, numbers) for scene, numbers in list_scenes(config, episodes)]


def test_more_episodes_only_add_to_the_list(make_config):
    assert listed(make_config(), 3) == [("home_7_0000", (0, 1)), ("home_7_0001", (0,))]
    assert listed(make_config(), 4) == [("home_7_0000", (0, 1)), ("home_7_0001", (0, 1))]


def test_the_world_of_miniworld_has_scenes_of_its_own_name(make_config):
    assert listed(make_config(world="miniworld"), 3) == [("miniworld_7_0000", (0, 1)), ("miniworld_7_0001", (0,))]


def test_a_folder_of_public_files_names_its_homes(make_config, tmp_path):
    episode = Episode(start_pose=np.array([1.0, 2.0, 0.5]), goal_xy_m=np.array([3.0, 4.0]))
    for name in ("home_2_0001", "miniworld_2_0000"):
        write_episodes(tmp_path / name / "pointgoal_start_goal_pairs.npy", (episode,))
    assert listed(make_config(world=str(tmp_path)), 9) == [("home_2_0001", (0, 1)), ("miniworld_2_0000", (0, 1))]


@pytest.mark.parametrize(
    ("scene", "message"), [("kitchen", "home_SEED_INDEX"), (None, "must be homes, miniworld, or a folder")]
)
def test_a_folder_of_anything_else_is_refused(make_config, tmp_path, scene, message):
    if scene:
        write_episodes(tmp_path / scene / "pointgoal_start_goal_pairs.npy", ())
    with pytest.raises(ConfigError, match=message):
        list_scenes(make_config(world=str(tmp_path)), 1)
