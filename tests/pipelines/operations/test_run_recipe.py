"""`wsm run`: stages in their order, in one folder, again and beside."""

from dataclasses import replace

import pytest
from fake_wsm import use_fake_stages

from pipelines import recipe, registry
from pipelines.operations.run_recipe import run_recipe
from pipelines.running.folder import read_stage_record, write_stage_record
from pipelines.running.options import RunOptions, StageRequest
from wsm_data.errors import ConfigError


def request(out, *assignments, **options):
    """A request for one worker, with some options."""
    return StageRequest(out=out, assignments=assignments, options=RunOptions(quiet=True, **options))


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
        run_recipe(str(path), request(tmp_path / "run", *assignments, **options))
        return calls()

    return go


def test_the_stages_of_a_recipe_run_in_order_and_their_table_is_printed(run, tmp_path, capsys):
    run()
    first_words = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert first_words == ["stage", "copy", "join"]
    assert (tmp_path / "run" / "join" / "a1").read_text() == "text of a1!"


def test_the_second_run_does_nothing(run):
    run()
    assert run() == []


def test_a_selection_narrows_the_first_stage_and_the_others_take_what_there_is(run, tmp_path):
    assert run(only=("b*",)) == ["b1", "finish"]
    assert (tmp_path / "run" / "join" / "b1").exists()
    assert run() == ["a1", "a2", "finish"]
    assert (tmp_path / "run" / "join" / "a1").exists()


def test_a_dry_run_plans_what_can_be_planned_and_writes_nothing(run, tmp_path, capsys):
    assert run(dry_run=True) == []
    said = capsys.readouterr().out
    assert "copy: would do a1" in said
    assert "join: will be planned when the stages before it have run" in said
    assert not (tmp_path / "run").exists()
    assert said.index("copy: settings") < said.index("join: settings") < said.index("copy: would do a1")


def test_a_dry_run_plans_every_stage_whose_inputs_are_there(run, capsys):
    run()
    capsys.readouterr()
    run(dry_run=True)
    said = capsys.readouterr().out
    assert "will be planned" not in said
    assert "would do" not in said


def test_a_dry_run_after_a_change_upstream_leaves_the_rest_open(run, tmp_path, source, capsys):
    run()
    folder = tmp_path / "run" / "copy"
    write_stage_record(folder, replace(read_stage_record(folder), finished=""))  # as a kill leaves it
    (source / "a2.txt").write_text("changed")
    run(dry_run=True)
    said = capsys.readouterr().out
    assert "copy: would do a2" in said
    assert "join: will be planned when the stages before it have run" in said


def test_a_dry_run_counts_the_units_it_does_not_list(run, source, capsys):
    for number in range(30):
        (source / f"c{number:02d}.txt").write_text("more")
    run(dry_run=True)
    said = capsys.readouterr().out
    assert said.count("copy: would do") == 20
    assert "copy: and 13 more, 33 in all" in said


@pytest.mark.parametrize("dry_run", [True, False])
@pytest.mark.parametrize(
    ("assignment", "said"),
    [
        ("join.cpoy=x", r"unknown key join\.cpoy; did you mean join\.copy\?"),
        ("copy.sorce=x", r"unknown key copy\.sorce; did you mean copy\.source\?"),
    ],
)
def test_settings_of_every_stage_are_checked_before_the_first_runs(run, calls, tmp_path, assignment, said, dry_run):
    with pytest.raises(ConfigError, match=said):
        run(assignment, dry_run=dry_run)
    assert calls() == []
    assert not (tmp_path / "run").exists()


def test_a_stage_that_ended_is_told_of_although_a_later_one_fails(run, tmp_path, capsys):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "join").write_text("in the way")
    with pytest.raises(ConfigError, match="join must be a folder"):
        run()
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["stage", "copy"]


def test_a_selection_of_nothing_is_refused(run, tmp_path):
    with pytest.raises(ConfigError, match=r"--only z\* matches none of 3 units; ids look like a1"):
        run(only=("a*", "z*"))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("dry_run", [True, False])
def test_changed_settings_of_any_stage_stop_the_run_before_its_first_stage(run, tmp_path, source, dry_run):
    run()
    folder = tmp_path / "run" / "join"
    write_stage_record(folder, replace(read_stage_record(folder), version=7, fingerprint="of version 7"))
    (source / "a1.txt").write_text("changed")  # so that `copy` has something to do
    with pytest.raises(
        ConfigError, match="join was written with other settings of `wsm join`:\n  version of the stage: 7 -> 1"
    ):
        run(dry_run=dry_run)
    assert (tmp_path / "run" / "copy" / "copies" / "a1.txt").read_text() == "text of a1"


def test_the_changed_settings_of_all_stages_are_named_at_once(run, tmp_path):
    run()
    folder = tmp_path / "run" / "join"
    write_stage_record(folder, replace(read_stage_record(folder), version=7, fingerprint="of version 7"))
    with pytest.raises(ConfigError, match=r"repeat: 1 -> 2\n(.*\n)*.*version of the stage: 7 -> 1"):
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


def test_a_codec_that_cannot_begin_stops_the_run_before_its_first_stage(tmp_path, monkeypatch):
    monkeypatch.undo()  # the real stages
    words = ["source=absent", f"encode.codec.weights={tmp_path / 'vae'}"]
    with pytest.raises(ConfigError, match="codec dct has no weights"):
        run_recipe("interndata", request(tmp_path / "run", *words))
    assert not (tmp_path / "run").exists()
