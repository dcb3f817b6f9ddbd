"""A stage's folder: one writer, a ledger that survives being cut, a quarantine that keeps its times."""

import json
import subprocess
import sys
from dataclasses import replace

import pytest

from pipelines.running.folder import (
    LedgerEntry,
    StageRecord,
    compact_ledger,
    ledger_appender,
    locked,
    read_ledger,
    read_stage_record,
    refusal_from_json,
    refusal_json,
    write_quarantine,
    write_stage_record,
)
from pipelines.running.stage import Outcome, Unit, refused
from wsm_data.errors import ConfigError, DataError, IntegrityError, Reason
from wsm_data.files.journal import JournalWriter, read_records
from wsm_data.files.jsonlines import read_lines

RECORD = StageRecord(
    name="copy",
    version=3,
    settings={"a": 1},
    config={"a": 1, "source": "tree"},
    fingerprint="f" * 8,
    inputs={"index": "1"},
    seen={"index": "2"},
    units=4,
    workers=2,
)
LINE = {
    "unit": "a",
    "key": "k",
    "state": "done",
    "digest": "",
    "outputs": [],
    "facts": {},
    "refusals": [],
    "seconds": 0.5,
    "sizes": [],
    "time": 7.5,
}


def entry(unit, key="k", **values):
    return LedgerEntry(key=key, outcome=Outcome(unit=unit, **values))


def refusal(unit, message="it is empty"):
    return refused(
        Unit(id=unit, source=f"{unit}.txt", inputs={}), DataError(Reason.FRAME_EMPTY, message, {"bytes": 0})
    ).refusals[0]


def add(folder, *entries):
    with ledger_appender(folder) as append:
        return [append(one) for one in entries]


# the record


def test_a_folder_without_a_record_was_written_by_no_stage(tmp_path):
    assert read_stage_record(tmp_path) is None


def test_a_record_is_read_back(tmp_path):
    write_stage_record(tmp_path, RECORD)
    assert read_stage_record(tmp_path) == RECORD


@pytest.mark.parametrize("text", ["", "{", "{}", "[1]", '{"name": "copy", "what": 1}'])
def test_a_record_that_cannot_be_read_is_damage(tmp_path, text):
    (tmp_path / "stage.json").write_text(text)
    with pytest.raises(IntegrityError, match="is not a stage record"):
        read_stage_record(tmp_path)


# the ledger


def test_the_ledger_keeps_the_last_word_on_every_unit(tmp_path):
    add(tmp_path, entry("a", "old"), entry("b"), entry("a", "new"))
    assert {unit: one.key for unit, one in read_ledger(tmp_path).items()} == {"a": "new", "b": "k"}


def test_an_outcome_is_read_back_as_it_was_returned_when_it_was_added(tmp_path):
    whole = entry(
        "a",
        state="refused",
        digest="d",
        outputs=("x/1", "x/2"),
        facts={"words": ("a", "b"), "n": 1},
        refusals=(refusal("a"),),
        seconds=1.23456,
    )
    (returned,) = add(tmp_path, whole)
    assert read_ledger(tmp_path) == {"a": returned}
    expected = replace(whole.outcome, facts={"words": ["a", "b"], "n": 1}, seconds=1.2346)
    assert returned == replace(whole, outcome=expected, sizes=(None, None), time_s=returned.time_s)  # nobody wrote them


def test_a_torn_last_line_is_as_if_it_had_not_been_written(tmp_path):
    add(tmp_path, entry("a"), entry("b"))
    ledger = tmp_path / "ledger.jsonl"
    ledger.write_bytes(ledger.read_bytes()[:-7])
    assert list(read_ledger(tmp_path)) == ["a"]
    add(tmp_path, entry("c"))
    assert list(read_ledger(tmp_path)) == ["a", "c"]


def test_compacting_keeps_the_lines_that_count_and_deletes_files_that_nobody_claims(tmp_path):
    for name in ("old", "new", "gone", "shared"):
        (tmp_path / name).touch()
    add(
        tmp_path,
        entry("a", "1", outputs=("old", "shared")),
        entry("gone", outputs=("gone", "shared")),
        entry("a", "2", outputs=("new", "shared")),
    )
    lines = (tmp_path / "ledger.jsonl").read_bytes().splitlines(keepends=True)
    compact_ledger(tmp_path, {"a": entry("a", "2")}, {})
    assert {path.name for path in tmp_path.iterdir()} == {"new", "shared", "ledger.jsonl"}
    assert (tmp_path / "ledger.jsonl").read_bytes() == lines[2]


def test_a_ledger_with_nothing_to_compact_is_left_alone(tmp_path):
    add(tmp_path, entry("a", outputs=("x",)))
    before = (tmp_path / "ledger.jsonl").stat().st_ino
    compact_ledger(tmp_path, {"a": entry("a")}, {})
    assert (tmp_path / "ledger.jsonl").stat().st_ino == before


def test_compacting_makes_one_file_of_what_several_runs_added(tmp_path):
    for unit in ("a", "b"):
        add(tmp_path, entry(unit))
    compact_ledger(tmp_path, {"a": entry("a"), "b": entry("b")}, {})
    assert [path.name for path in tmp_path.iterdir()] == ["ledger.jsonl"]
    assert list(read_ledger(tmp_path)) == ["a", "b"]


@pytest.mark.parametrize("output", ["../kept", "x/../../kept", "/kept", "..", ".", ""])
def test_an_output_outside_the_folder_is_refused_and_nothing_is_deleted(tmp_path, output):
    out = tmp_path / "out"
    (out / "x").mkdir(parents=True)
    (tmp_path / "kept").touch()
    name = str(tmp_path / "kept") if output == "/kept" else output
    with JournalWriter(out, "ledger") as journal:
        journal.append({**LINE, "outputs": [name]})
    for read in (lambda: read_ledger(out), lambda: compact_ledger(out, {}, {})):
        with pytest.raises(IntegrityError, match="must name outputs of unit a inside the folder"):
            read()
    assert (tmp_path / "kept").exists()


def test_compacting_passes_over_files_that_are_gone_already(tmp_path):
    add(tmp_path, entry("a", outputs=("never written",)))
    compact_ledger(tmp_path, {}, {})
    assert read_ledger(tmp_path) == {}


def test_a_stale_line_keeps_its_files_and_is_read_only_by_who_asks_for_it(tmp_path):
    (tmp_path / "kept").write_bytes(b"1234")
    add(tmp_path, entry("a", outputs=("kept",)), entry("b"))
    compact_ledger(tmp_path, {"b": entry("b")}, {"a": entry("a")})
    assert list(read_ledger(tmp_path)) == ["b"]
    stale = read_ledger(tmp_path, with_stale=True)["a"]
    assert (stale.stale, stale.sizes, (tmp_path / "kept").exists()) == (True, (4,), True)
    compact_ledger(tmp_path, {"a": entry("a"), "b": entry("b")}, {})
    assert not read_ledger(tmp_path)["a"].stale


def test_a_ledger_from_before_checksums_is_read_and_goes_on(tmp_path):
    old = {name: value for name, value in LINE.items() if name != "sizes"}
    (tmp_path / "ledger.jsonl").write_text(json.dumps(old) + "\n" + json.dumps({**old, "unit": "b"}) + "\n")
    add(tmp_path, entry("b", "new"), entry("c"))
    assert {unit: one.key for unit, one in read_ledger(tmp_path).items()} == {"a": "k", "b": "new", "c": "k"}
    compact_ledger(tmp_path, read_ledger(tmp_path), {})
    assert [line["unit"] for line in read_records(tmp_path / "ledger.jsonl")] == ["a", "b", "c"]


# the quarantine


def test_a_refusal_is_read_back():
    one = refusal("a")
    assert refusal_from_json(json.loads(json.dumps(refusal_json(one)))) == one


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


# the lock

HOLDER = (
    "import sys; from pathlib import Path; from pipelines.running.folder import locked\n"
    "with locked(Path(sys.argv[1])):\n    print('held', flush=True)\n    sys.stdin.read()"
)


@pytest.fixture
def holder(tmp_path):
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        yield process
        process.kill()


def test_a_second_writer_is_refused(tmp_path, holder):
    with pytest.raises(ConfigError, match="is being written by another wsm process"), locked(tmp_path):
        pass


def test_the_lock_of_a_killed_process_falls(tmp_path, holder):
    holder.kill()
    holder.wait()
    with locked(tmp_path), pytest.raises(ConfigError), locked(tmp_path):
        pass  # it is held anew


def test_the_lock_falls_with_an_error(tmp_path):
    with pytest.raises(KeyError), locked(tmp_path):
        raise KeyError
    with locked(tmp_path):
        pass


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_a_folder_that_cannot_be_is_a_wrong_request(tmp_path, out):
    (tmp_path / "file").write_text("here already")
    with (
        pytest.raises(ConfigError, match=r"must be a folder that can be written .*; use another"),
        locked(tmp_path / out),
    ):
        pass
    assert (tmp_path / "file").read_text() == "here already"


def test_the_lock_file_is_empty_and_the_same_in_every_folder(tmp_path):
    with locked(tmp_path):
        pass
    assert (tmp_path / ".lock").read_bytes() == b""
