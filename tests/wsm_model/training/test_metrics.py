"""Metrics of a run that is killed and gone on with."""

import json
import re
from pathlib import Path

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from wsm_data.errors import IntegrityError
from wsm_model.training.metrics import metrics_writer


def steps_of(folder: Path) -> list[int]:
    """Steps in the file, in its order."""
    return [json.loads(line)["step"] for line in (folder / "metrics.jsonl").read_text().splitlines()]


def log(folder: Path, done: int, steps: range, loss: float = 1.0) -> None:
    """Write some steps of a run that had done `done` of them."""
    with metrics_writer(folder, done) as write:
        for step in steps:
            write(step, {"loss": loss / step, "seconds": 0.5})


def test_a_line_holds_step_and_numbers_exactly_and_is_there_at_once(tmp_path):
    with metrics_writer(tmp_path, 0) as write:
        write(1, {"loss": 0.1 + 0.2, "flow": 1e-30})
        text = (tmp_path / "metrics.jsonl").read_text()  # a kill after this loses nothing
    assert json.loads(text) == {"step": 1, "loss": 0.1 + 0.2, "flow": 1e-30}


def test_lines_after_the_checkpoint_are_taken_out_and_written_again(tmp_path):
    log(tmp_path, 0, range(1, 6), loss=1.0)  # killed after step 5; its last checkpoint is that of step 3
    before = (tmp_path / "metrics.jsonl").read_text().splitlines()
    log(tmp_path, 3, range(4, 8), loss=9.0)
    after = (tmp_path / "metrics.jsonl").read_text().splitlines()
    assert steps_of(tmp_path) == [1, 2, 3, 4, 5, 6, 7]
    assert after[:3] == before[:3]
    assert json.loads(after[3])["loss"] == 9.0 / 4


def test_a_run_that_starts_anew_keeps_no_line(tmp_path):
    log(tmp_path, 0, range(1, 4))
    log(tmp_path, 0, range(1, 2))
    assert steps_of(tmp_path) == [1]


def test_a_torn_last_line_goes_and_the_next_stands_on_a_line_of_its_own(tmp_path):
    log(tmp_path, 0, range(1, 4))
    with (tmp_path / "metrics.jsonl").open("a") as file:
        file.write('{"loss":0.3,"st')
    log(tmp_path, 3, range(4, 5))
    assert steps_of(tmp_path) == [1, 2, 3, 4]


def test_a_whole_line_that_is_no_json_is_named_and_nothing_is_lost(tmp_path):
    log(tmp_path, 0, range(1, 3))
    path = tmp_path / "metrics.jsonl"
    path.write_text(path.read_text() + "loss = 3\n")
    before = path.read_bytes()
    with pytest.raises(IntegrityError, match=r"metrics\.jsonl:3 is not JSON"):
        log(tmp_path, 2, range(3, 4))
    assert path.read_bytes() == before


def test_a_number_that_is_not_finite_is_refused_and_leaves_whole_lines(tmp_path):
    with metrics_writer(tmp_path, 0) as write:
        write(1, {"loss": 1.0})
        with pytest.raises(ValueError, match="not JSON compliant"):
            write(2, {"loss": float("nan")})
    assert steps_of(tmp_path) == [1]


def test_tensorboard_shows_the_same_numbers_and_each_step_once(tmp_path):
    log(tmp_path, 0, range(1, 6), loss=1.0)
    (events,) = (tmp_path / "tensorboard").iterdir()
    # Files are read in the order of the second in their names, and both parts of this run fall into one.
    events.rename(events.with_name(re.sub(r"tfevents\.\d+", "tfevents.1000000000", events.name)))
    log(tmp_path, 3, range(4, 8), loss=9.0)
    board = EventAccumulator(str(tmp_path / "tensorboard"))
    board.Reload()
    shown = [(event.step, event.value) for event in board.Scalars("loss")]
    wanted = [json.loads(line) for line in (tmp_path / "metrics.jsonl").read_text().splitlines()]
    assert [step for step, _ in shown] == [line["step"] for line in wanted]
    # TensorBoard stores float32
    assert [value for _, value in shown] == pytest.approx([line["loss"] for line in wanted], rel=1e-6)
