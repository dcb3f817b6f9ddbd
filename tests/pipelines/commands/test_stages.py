"""`wsm run`: stages in their order, in one folder, again and beside."""

import pytest
from fake_wsm import use_fake_stages

from pipelines import recipe, registry
from pipelines.commands.stages import run_recipe
from wsm_data.errors import ConfigError

OPTIONS = {
    "workers": 1,
    "engine": "local",
    "limit": 0,
    "only": None,
    "dry_run": False,
    "max_refused": 0.1,
    "fork": False,
    "retry_refused": False,
    "quiet": True,
}


@pytest.fixture(autouse=True)
def fake_registry(monkeypatch):
    monkeypatch.setattr(registry, "STAGES", registry.STAGES)  # both are put back afterwards
    monkeypatch.setattr(registry, "load_stage_module", registry.load_stage_module)
    use_fake_stages()
    monkeypatch.setattr(recipe, "_NAMES", ("copy", "join"))


@pytest.fixture
def run(tmp_path, source, calls):
    """Runs the recipe of both fake stages into a folder; returns what the first one worked on."""
    path = tmp_path / "both.toml"
    path.write_text(f'stages = ["copy", "join"]\n[copy]\nsource = "{source}"\n')

    def go(*assignments, **options):
        run_recipe(str(path), tmp_path / "run", None, assignments, **{**OPTIONS, **options})
        return calls()

    return go


def test_the_stages_of_a_recipe_run_in_order_and_their_table_is_printed(run, tmp_path, capsys):
    run()
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["stage", "copy", "join"]
    assert (tmp_path / "run" / "join" / "a1").read_text() == "text of a1!"


def test_the_second_run_does_nothing(run):
    run()
    assert run() == []


def test_a_selection_narrows_the_first_stage_and_the_others_take_what_there_is(run, tmp_path):
    assert run(only=["b*"]) == ["b1", "finish"]
    assert (tmp_path / "run" / "join" / "b1").exists()
    assert run() == ["a1", "a2", "finish"]
    assert (tmp_path / "run" / "join" / "a1").exists()


def test_a_dry_run_plans_what_can_be_planned_and_writes_nothing(run, tmp_path, capsys):
    assert run(dry_run=True) == []
    said = capsys.readouterr().out
    assert "copy: would do a1" in said
    assert "join: will be planned when the stages before it have run" in said
    assert not (tmp_path / "run").exists()


def test_changed_settings_stop_the_run_before_anything_is_written(run, tmp_path):
    run()
    with pytest.raises(ConfigError, match="repeat: 1 -> 2"):
        run("copy.repeat=2")


def test_a_fork_runs_changed_settings_in_a_folder_beside_and_stays_where_nothing_changed(run, tmp_path, capsys):
    run(fork=True)
    assert run(fork=True) == []
    assert run("copy.repeat=2", fork=True) == ["a1", "a2", "b1", "finish"]
    assert run("copy.repeat=2", fork=True) == []
    assert run("copy.pause_s=0.001", fork=True) == []  # a speed setting is no other run
    beside = [path for path in tmp_path.iterdir() if path.name.startswith("run-")]
    assert len(beside) == 1
    assert (beside[0] / "join" / "a1").read_text() == "text of a1" * 2 + "!"
    assert (tmp_path / "run" / "join" / "a1").read_text() == "text of a1!"
