"""The quarantine of a stage keeps its times; both it and what is pending are read by the types of their fields."""

import pytest

from pipelines.running.folder import StageRecord
from pipelines.running.quarantine import (
    PENDING_FILE,
    QUARANTINE_FILE,
    read_pending,
    read_quarantine,
    write_pending,
    write_quarantine,
)
from pipelines.running.stage import Unit, refused
from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.files.jsonlines import read_lines, write_lines

RECORD = StageRecord(name="copy", version=3, settings={}, config={}, fingerprint="f" * 8, inputs={}, seen={})


def refusal(unit, message="it is empty"):
    return refused(
        Unit(id=unit, source=f"{unit}.txt", inputs={}), DataError(Reason.FRAME_EMPTY, message, {"bytes": 0})
    ).refusals[0]


def test_a_refusal_is_read_back(tmp_path):
    one = refusal("a")
    write_quarantine(tmp_path, RECORD, [one])
    assert read_quarantine(tmp_path / QUARANTINE_FILE) == (one,)


def test_pending_units_are_read_back_in_their_order(tmp_path):
    assert read_pending(tmp_path / PENDING_FILE) == ()
    write_pending(tmp_path, ["b", "a"])
    assert read_pending(tmp_path / PENDING_FILE) == ("b", "a")


@pytest.mark.parametrize(("name", "value"), [("unit", None), ("reason", "no.such"), ("details", []), ("time", "now")])
def test_a_line_that_is_no_refusal_is_damage_and_says_where(tmp_path, name, value):
    write_quarantine(tmp_path, RECORD, [refusal("a"), refusal("b")])
    first, second = read_lines(tmp_path / QUARANTINE_FILE)
    changed = {key: old for key, old in second.items() if key != name} | ({name: value} if value is not None else {})
    write_lines(tmp_path / QUARANTINE_FILE, [first, changed])
    for read in (lambda: read_quarantine(tmp_path / QUARANTINE_FILE), lambda: write_quarantine(tmp_path, RECORD, [])):
        with pytest.raises(IntegrityError, match=rf"quarantine\.jsonl:2 must hold a refusal, but: .*{name}"):
            read()


@pytest.mark.parametrize("line", [{}, {"unit": 1}, {"unit": "a", "more": 1}])
def test_a_line_that_is_no_pending_unit_is_damage(tmp_path, line):
    write_lines(tmp_path / PENDING_FILE, [line])
    with pytest.raises(IntegrityError, match=r"pending\.jsonl:1 must hold a pending unit"):
        read_pending(tmp_path / PENDING_FILE)


def test_the_quarantine_names_stage_version_and_fingerprint_and_is_sorted_by_unit(tmp_path):
    write_quarantine(tmp_path, RECORD, [refusal("b"), refusal("a")])
    lines = list(read_lines(tmp_path / "quarantine.jsonl"))
    assert [line["unit"] for line in lines] == ["a", "b"]
    assert (lines[0]["stage"], lines[0]["stage_version"], lines[0]["fingerprint"]) == ("copy", 3, "f" * 8)


def test_a_refusal_keeps_the_time_it_was_first_written(tmp_path, monkeypatch):
    monkeypatch.setattr("time.time", lambda: 100.0)
    write_quarantine(tmp_path, RECORD, [refusal("a"), refusal("b")])
    monkeypatch.setattr("time.time", lambda: 200.0)
    write_quarantine(tmp_path, RECORD, [refusal("a"), refusal("b", "something else"), refusal("c")])
    times = {line["unit"]: line["time"] for line in read_lines(tmp_path / "quarantine.jsonl")}
    assert times == {"a": 100.0, "b": 200.0, "c": 200.0}


def test_what_is_no_longer_refused_leaves_the_quarantine(tmp_path):
    write_quarantine(tmp_path, RECORD, [refusal("a")])
    write_quarantine(tmp_path, RECORD, [])
    assert (tmp_path / "quarantine.jsonl").read_bytes() == b""
