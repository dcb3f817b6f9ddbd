"""wsm eval table: the paper's figures as printed there, and summaries beside them."""

import csv
import json

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.evaluating.tables.paper import PAPER_TABLES

INTERVAL = {"value": 0.5, "low": 0.25, "high": 0.75, "resampled": "scenes"}
NAV = {
    "planner": "agent",
    "inputs": ["rgb", "goal"],
    "goal": "fixed",
    "controller_pose": "estimated",
    "protocol": "navdp-2025-12",
    "world": "homes",
    "episodes": 40,
    "success_rate": INTERVAL,
    "spl_geodesic": INTERVAL,
}
SLAM = {
    "release": "0123456789",
    "split": "test",
    "system": "runs/tiny/model",
    "inputs": None,
    "sequences": 3,
    "ate_rmse_sim3_m": INTERVAL,
    "acc_rmse_m": None,
}


def wsm_table(*words):
    return CliRunner().invoke(app, ["eval", "table", *map(str, words)])


@pytest.fixture
def evaluation(tmp_path):
    def make(summary):
        folder = tmp_path / "evaluation"
        folder.mkdir()
        (folder / "summary.json").write_text(summary if isinstance(summary, str) else json.dumps(summary))
        return folder

    return make


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", PAPER_TABLES)
def test_each_table_of_the_paper_is_printed_and_written_in_three_forms(tmp_path, name):
    done = wsm_table(name, "--out", tmp_path)
    assert done.exit_code == 0, done.output
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.txt", f"{name}.csv", f"{name}.png"}
    assert (tmp_path / f"{name}.txt").read_text() in done.output
    assert len(rows_of(tmp_path / f"{name}.csv")) == len(PAPER_TABLES[name].rows)


def test_post_training_gains_what_the_text_of_the_paper_says():
    """Appendix: 5.7 and 5.4 points of SR, 4.8 and 4.9 of SPL, at home and in commercial scenes."""
    before, after = PAPER_TABLES["stages"].rows[:2], PAPER_TABLES["stages"].rows[2:]
    gains = [
        round(late.figures[column].value - early.figures[column].value, 1)
        for column in PAPER_TABLES["stages"].columns
        for early, late in zip(before, after, strict=True)
    ]
    assert gains == [5.7, 5.4, 4.8, 4.9]


def test_an_evaluation_stands_beside_the_paper_in_percent_with_its_interval_and_what_it_knew(tmp_path, evaluation):
    done = wsm_table("navigation", f"tiny, 4 steps={evaluation(NAV)}", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    row = rows_of(tmp_path / "out" / "navigation.csv")[-1]
    assert (row["system"], row["source"], row["data"]) == ("tiny, 4 steps", "measured", "homes, 40 episodes")
    assert (row["inputs"], row["goal"], row["controller_pose"]) == ("rgb", "fixed", "estimated")
    assert row["protocol"] == "navdp-2025-12"
    assert [float(row[f"SR %{end}"]) for end in ("", " low", " high")] == [50.0, 25.0, 75.0]
    assert "50 [25, 75]" in done.output


def test_what_an_evaluation_could_not_measure_is_left_empty(tmp_path, evaluation):
    assert wsm_table("slam", evaluation(SLAM), "--out", tmp_path / "out").exit_code == 0
    row = rows_of(tmp_path / "out" / "slam.csv")[-1]
    assert (row["system"], row["data"]) == ("model", "release 01234567, test, 3 sequences")
    assert row["inputs"] == "-"  # what another system was given, only who ran it knows
    assert (row["ATE RMSE m"], row["Acc. RMSE m"]) == ("0.5", "")


@pytest.mark.parametrize(
    ("summary", "code", "message"),
    [(SLAM, 2, "success_rate"), ("{", 4, "must be JSON"), ("[]", 4, "JSON object")],
    ids=["of another kind", "cut off", "no object"],
)
def test_a_summary_that_cannot_stand_there_is_refused(tmp_path, evaluation, summary, code, message):
    done = wsm_table("navigation", evaluation(summary), "--out", tmp_path / "out")
    assert done.exit_code == code
    assert message in done.output


def test_a_folder_without_a_summary_is_refused(tmp_path):
    done = wsm_table("idm", tmp_path / "nowhere", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "summary.json" in done.output
