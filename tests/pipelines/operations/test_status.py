"""`wsm status`: the table, the JSON, and the watch."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from fake_runs import ANY
from fake_stages import COPY, JOIN, JoinConfig
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.status import RunStatus, run_status, show_status, status_text
from pipelines.running.folder import read_stage_record, write_stage_record
from pipelines.running.runner import run_stage
from pipelines.running.stage_status import StageStatus, UnitTime
from wsm_data.errors import ConfigError


@pytest.fixture
def run(config, source, out):
    """`copy` with a refusal, and `join` after it."""
    (source / "a2.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    run_stage(JOIN, JoinConfig(copy=out), out.parent / "join", ANY)
    return out.parent


def test_the_table_has_rates_reasons_and_the_slowest_units():
    copy = StageStatus(
        stage="index",
        state="running",
        writer=41,
        listed=9000,
        done=10,
        refused=2,
        pending=8988,
        refused_parts=1,
        refusals={"frame.empty": 3},
        per_s=0.5,
        remaining_s=17976.0,
        slowest=(UnitTime(unit="a", seconds=3.21),),
    )
    text = status_text(RunStatus(run=Path("run"), locks_visible=False, stages=(copy,)))
    assert text.splitlines() == [
        "stage  state    units  done      refused  pending  units/s     left  process",
        "index  running   9000    10  2 + 1 parts     8988      0.5  4:59:36  41",  # 17976 s = 4 h 59 min 36 s
        "refused, by reason:",
        "  index: 3 x frame.empty",
        "slowest units:",
        "  index: a 3.2 s",
        "this system does not show which process holds a folder",
    ]


def test_the_command_tells_of_a_run_as_json(run):
    done = CliRunner().invoke(app, ["status", str(run), "--json"])
    assert done.exit_code == 0
    (line,) = done.stdout.splitlines()
    stages = {stage["stage"]: stage for stage in json.loads(line)["stages"]}
    assert {name: (one["state"], one["done"], one["refused"]) for name, one in stages.items()} == {
        "copy": ("finished", 2, 1),
        "join": ("finished", 2, 0),
    }
    assert stages["copy"]["refusals"] == {"frame.empty": 1}


def test_stages_stand_in_the_order_of_the_flow_whatever_their_folders_are_called(run):
    for folder, name in (("copy", "pack"), ("join", "index")):
        record = read_stage_record(run / folder)
        write_stage_record(run / folder, replace(record, name=name))
    assert [stage.stage for stage in run_status(run).stages] == ["join", "copy"]


def test_a_watch_looks_again_until_it_is_interrupted(run, capsys, monkeypatch):
    pauses = []

    def sleep(seconds):
        pauses.append(seconds)
        if len(pauses) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr("pipelines.operations.status.time.sleep", sleep)
    with pytest.raises(KeyboardInterrupt):
        show_status(run, as_json=True, watch=True)
    assert len(capsys.readouterr().out.splitlines()) == 3
    assert pauses == [2.0] * 3


@pytest.mark.parametrize("name", ["", "absent"])
def test_a_folder_of_no_run_is_refused(tmp_path, name):
    with pytest.raises(ConfigError, match="must be the folder of a run or of a stage"):
        run_status(tmp_path / name)
