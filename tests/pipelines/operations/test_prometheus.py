"""Numbers of a run in the text format of Prometheus, read back by a parser of its grammar."""

import re

from fake_runs import ANY
from fake_stages import COPY
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.prometheus import prometheus_text
from pipelines.running.runner import run_stage
from pipelines.running.stage_status import StageStatus

SAMPLE = re.compile(r'([a-z_]+)\{((?:[a-z]+="(?:[^"\\\n]|\\["\\n])*",?)*)\} ([-+.e0-9]+)')
LABEL = re.compile(r'([a-z]+)="((?:[^"\\\n]|\\["\\n])*)"')


def read(text):
    """Samples by name and labels; every line must be one, or say what the next ones are."""
    found = {}
    for line in text.splitlines():
        if not line.startswith("# "):
            name, labels, value = SAMPLE.fullmatch(line).groups()
            found[name, tuple(LABEL.findall(labels))] = float(value)
    return found


def status(**changes):
    counts = {"listed": 9, "done": 5, "refused": 1, "pending": 3}
    return StageStatus(**{"stage": "encode", "state": "running", "writer": 4, **counts, **changes})


def test_units_reasons_and_rates_are_told_by_run_and_stage():
    of = (("run", "runs/n1"), ("stage", "encode"))
    found = read(prometheus_text("runs/n1", [status(refusals={"frame.empty": 2}, per_s=0.5, remaining_s=6.0)]))
    assert found == {
        ("wsm_units", (*of, ("state", "done"))): 5.0,
        ("wsm_units", (*of, ("state", "refused"))): 1.0,
        ("wsm_units", (*of, ("state", "pending"))): 3.0,
        ("wsm_refusals", (*of, ("reason", "frame.empty"))): 2.0,
        ("wsm_stage_running", of): 1.0,
        ("wsm_unit_seconds", of): 0.0,
        ("wsm_units_per_second", of): 0.5,
        ("wsm_remaining_seconds", of): 6.0,
    }


def test_what_is_not_known_is_left_out():
    names = {name for name, _ in read(prometheus_text("r", [status(state="finished", writer=None)]))}
    assert names == {"wsm_units", "wsm_stage_running", "wsm_unit_seconds"}


def test_a_folder_may_be_called_anything():
    text = prometheus_text('a"b\\c\nd', [status()])
    assert {dict(labels)["run"] for _, labels in read(text)} == {r"a\"b\\c\nd"}


def test_every_gauge_says_what_it_is_before_its_samples():
    lines = prometheus_text("r", [status(per_s=1.0, remaining_s=3.0)]).splitlines()
    described = [line.split()[2] for line in lines if line.startswith("# TYPE")]
    assert len(described) == len(set(described)) == 6
    assert [line.split()[-1] for line in lines if line.startswith("# TYPE")] == ["gauge"] * 6


def test_the_command_writes_the_file_beside_its_table(out, config, tmp_path):
    run_stage(COPY, config, out, ANY)
    said = CliRunner().invoke(app, ["status", str(out.parent), "--prometheus", str(tmp_path / "wsm.prom")])
    assert said.exit_code == 0
    assert "copy" in said.stdout
    found = read((tmp_path / "wsm.prom").read_text())
    assert found["wsm_units", (("run", str(out.parent)), ("stage", "copy"), ("state", "done"))] == 3.0
