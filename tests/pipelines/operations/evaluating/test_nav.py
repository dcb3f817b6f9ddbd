import pytest

from pipelines.operations.evaluating.nav import describe, eval_nav, nav_config
from wsm_data.errors import ConfigError

SIM = {"protocol": "paper", "goal": "start", "estimated_controller_pose": False, "latency_steps": 2}


def config(planner="oracle", model=None, words=()):
    return nav_config(planner, model, "", "homes", 3, 2, SIM, words)


def test_options_and_words_become_settings(tmp_path):
    found = config("agent", tmp_path, ["sim.max_speed=0.3", "agent.flow_steps=4", "agent.session.chunk_size=2"])
    assert (found.sim.max_speed, found.sim.latency_steps) == (0.3, 2)
    assert (found.agent.flow_steps, found.agent.session.chunk_size) == (4, 2)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sim=1"], "takes sim.KEY=value, found sim=1"),
        (["speed=1"], "found the section 'speed'"),
        (["sim.latency_steps=1"], "sim.latency_steps has an option of its own"),
        (["sim.max_sped=1"], "did you mean sim.max_speed"),
        (["agent.seed=1"], "belong to --planner agent"),
    ],
)
def test_words_that_say_nothing_here_are_refused(words, message):
    with pytest.raises(ConfigError, match=message):
        config(words=words)


def test_a_dry_run_shows_scenes_and_writes_nothing(tmp_path, capsys):
    eval_nav(config(), tmp_path / "out", episodes=3, workers=1, films=0, dry_run=True, quiet=True)
    assert capsys.readouterr().out.endswith("home_3_0000: 2 episodes\nhome_3_0001: 1 episodes\n")
    assert not (tmp_path / "out").exists()


def test_the_text_says_what_a_row_knew_and_leaves_out_what_it_does_not_say():
    estimate = {"value": 0.5, "low": 0.25, "high": 0.75, "resampled": "scenes"}
    measures = (
        "success_rate",
        "spl_geodesic",
        "spl_straight",
        "collision_rate",
        "near_miss_rate",
        "seconds",
        "driven_m",
    )
    absent = dict.fromkeys(("navigation_error_m", "localisation_error_m", "ate_rmse_unaligned_m"))
    head = {"planner": "agent", "inputs": ["rgb", "goal"], "protocol": "paper", "goal": "fixed", "latency_steps": 1}
    counts = {
        "controller_pose": "true",
        "episodes": 4,
        "scenes": 2,
        "endings": {"stuck": 4},
        "refused": {"start.blocked": 1},
    }
    text = describe(dict.fromkeys(measures, estimate) | absent | head | counts)
    assert "agent (rgb, goal), protocol paper, goal fixed, controller on true poses" in text
    assert "4 episodes in 2 scenes, endings stuck 4; refused start.blocked 1" in text
    assert "0.500  0.250  0.750" in text
    assert "ate_rmse" not in text
