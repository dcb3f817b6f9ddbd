"""A stage's ledger: it survives being cut, is read by the types of its fields, and claims files."""

import json
from dataclasses import replace

import pytest

from pipelines.running.ledger import LedgerEntry, compact_ledger, ledger_appender, read_ledger
from pipelines.running.stage import Outcome, Unit, refused
from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.files.journal import JournalWriter, read_records

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
REFUSED = refused(Unit(id="a", source="a.txt", inputs={}), DataError(Reason.FRAME_EMPTY, "it is empty", {"bytes": 0}))


def entry(unit, key="k", **values):
    return LedgerEntry(key=key, outcome=Outcome(unit=unit, **values))


def add(folder, *entries):
    with ledger_appender(folder) as append:
        return [append(one) for one in entries]


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
        refusals=REFUSED.refusals,
        seconds=1.23456,
    )
    (returned,) = add(tmp_path, whole)
    assert read_ledger(tmp_path) == {"a": returned}
    expected = replace(whole.outcome, facts={"words": ["a", "b"], "n": 1}, seconds=1.2346)
    assert returned == replace(whole, outcome=expected, sizes=(None, None), time=returned.time)  # nobody wrote them


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
        with pytest.raises(IntegrityError, match=r"unit 'a' does not: .*outputs must lie inside the folder"):
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"unit": None}, "that of unit None does not: .*unit has no default"),
        ({"key": 7}, "key takes text"),
        ({"state": "half"}, "state must be done or refused, found 'half'"),
        ({"outputs": "x"}, "outputs takes a list"),
        ({"outputs": ["x", "y"], "sizes": [1]}, "sizes must be of the 2 outputs, found 1"),
        ({"outputs": ["x"], "digests": ["1", "2"]}, "digests must be of the 1 outputs, found 2"),
        ({"refusals": [{"unit": "a"}]}, r"refusals\.source has no default"),
        ({"seconds": "long"}, "seconds takes a number"),
        ({"yxh3": "0123456789abcdef"}, "unknown key yxh3"),
    ],
    ids=str,
)
def test_a_line_of_other_fields_or_types_is_damage_and_says_which(tmp_path, change, message):
    line = {name: value for name, value in (LINE | change).items() if value is not None}
    with JournalWriter(tmp_path, "ledger") as journal:
        journal.append(line)
    for read in (lambda: read_ledger(tmp_path), lambda: compact_ledger(tmp_path, {}, {})):
        with pytest.raises(IntegrityError, match=message):
            read()


def test_any_changed_byte_of_a_ledger_of_one_line_is_noticed_also_where_it_names_the_checksum(tmp_path):
    add(tmp_path, entry("a", facts={"n": 1}))
    path = tmp_path / "ledger.jsonl"
    data = path.read_bytes()
    for place in range(len(data) - 1):  # without the line break, it is a line that was not written to its end
        path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(IntegrityError):
            read_ledger(tmp_path)


def test_a_ledger_from_before_checksums_is_read_and_goes_on(tmp_path):
    old = {name: value for name, value in LINE.items() if name != "sizes"}
    (tmp_path / "ledger.jsonl").write_text(json.dumps(old) + "\n" + json.dumps({**old, "unit": "b"}) + "\n")
    add(tmp_path, entry("b", "new"), entry("c"))
    assert {unit: one.key for unit, one in read_ledger(tmp_path).items()} == {"a": "k", "b": "new", "c": "k"}
    compact_ledger(tmp_path, read_ledger(tmp_path), {})
    assert [line["unit"] for line in read_records(tmp_path / "ledger.jsonl")] == ["a", "b", "c"]
