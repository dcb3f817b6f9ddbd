"""Canonical JSON, and line files that survive a kill and notice damage."""

import json
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import canonical_json, line_appender, read_lines, write_lines

SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
JSON_VALUES = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4), max_leaves=12
)


@given(JSON_VALUES)
def test_canonical_json_reads_back_as_the_same_value(value):
    assert json.loads(canonical_json(value)) == value


@given(st.dictionaries(st.text(), SCALARS, min_size=2, max_size=6))
def test_insertion_order_does_not_change_the_spelling(record):
    assert canonical_json(record) == canonical_json(dict(reversed(record.items())))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_come_back_to_the_bit(number):
    assert json.loads(canonical_json(number)).hex() == number.hex()


def test_the_canonical_spelling_has_sorted_keys_and_no_spaces():
    assert (
        canonical_json({"b": [1, 2.0, True], "a": {"d": None, "c": "x y"}})
        == '{"a":{"c":"x y","d":null},"b":[1,2.0,true]}'
    )


@pytest.mark.parametrize("number", [float("nan"), float("inf"), float("-inf")])
def test_numbers_that_json_does_not_have_are_refused(number):
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical_json({"a": number})


def test_a_file_name_that_is_not_utf_8_can_be_written_and_read_back(tmp_path):
    name = os.fsdecode(b"scene_\xff")
    with line_appender(tmp_path / "a.jsonl") as append:
        append({"source": name})
    assert list(read_lines(tmp_path / "a.jsonl")) == [{"source": name}]


def test_appended_lines_are_read_in_order(tmp_path):
    path = tmp_path / "new" / "a.jsonl"
    with line_appender(path) as append:
        append({"n": 0})
        append({"n": 1})
    with line_appender(path) as append:
        append({"n": 2})
    assert list(read_lines(path)) == [{"n": 0}, {"n": 1}, {"n": 2}]


def test_an_appended_line_survives_the_death_of_its_writer(tmp_path):
    path = tmp_path / "a.jsonl"
    program = (
        "import os, sys; from pathlib import Path; from wsm_data.files.jsonlines import line_appender\n"
        "with line_appender(Path(sys.argv[1])) as append:\n    append({'n': 1})\n    os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", program, str(path)]).returncode == -9
    assert list(read_lines(path)) == [{"n": 1}]


@given(records=st.lists(st.dictionaries(st.text(), JSON_VALUES, max_size=3), max_size=5))
def test_written_records_are_read_back(tmp_path_factory, records):
    path = tmp_path_factory.mktemp("lines") / "a.jsonl"
    write_lines(path, records)
    assert list(read_lines(path)) == records


def test_a_line_break_inside_a_text_does_not_break_the_line(tmp_path):
    record = {"message": "first\nsecond\r\n\u2028third"}
    with line_appender(tmp_path / "a.jsonl") as append:
        append(record)
    assert (tmp_path / "a.jsonl").read_bytes().count(b"\n") == 1
    assert list(read_lines(tmp_path / "a.jsonl")) == [record]


def test_writing_replaces_what_was_there(tmp_path):
    write_lines(tmp_path / "a.jsonl", [{"n": 1}, {"n": 2}])
    write_lines(tmp_path / "a.jsonl", [{"n": 3}])
    assert list(read_lines(tmp_path / "a.jsonl")) == [{"n": 3}]


def test_a_file_that_does_not_exist_has_no_records(tmp_path):
    assert list(read_lines(tmp_path / "absent.jsonl")) == []


@pytest.mark.parametrize("torn_at", range(1, 8))
def test_a_torn_last_line_is_passed_over_wherever_it_was_cut(tmp_path, torn_at):
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"n":1}\n' + b'{"n":2}\n'[:torn_at])
    assert list(read_lines(path)) == [{"n": 1}]


def test_an_append_after_a_torn_line_is_noticed(tmp_path):
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"n":1}\n{"n":')
    with line_appender(path) as append:
        append({"n": 3})
    with pytest.raises(IntegrityError, match=r"a\.jsonl:2 "):
        list(read_lines(path))


@pytest.mark.parametrize("broken", [b"{n:2}", b"", b"\xff\xfe", b'{"n":2'])
def test_a_broken_complete_line_is_refused_by_its_number(tmp_path, broken):
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"n":1}\n' + broken + b'\n{"n":3}\n')
    lines = read_lines(path)
    assert next(lines) == {"n": 1}
    with pytest.raises(IntegrityError, match=r"a\.jsonl:2 is not JSON"):
        next(lines)


@pytest.mark.parametrize(("line", "found"), [(b"[1]", "list"), (b"17", "int"), (b"null", "NoneType")])
def test_a_line_that_is_json_but_no_object_is_refused(tmp_path, line, found):
    (tmp_path / "a.jsonl").write_bytes(line + b"\n")
    with pytest.raises(IntegrityError, match=rf"a\.jsonl:1 must hold one JSON object, found {found}"):
        list(read_lines(tmp_path / "a.jsonl"))


def test_lines_appended_by_two_processes_at_once_stay_whole(tmp_path):
    path = tmp_path / "a.jsonl"
    program = (
        "import sys; from pathlib import Path; from wsm_data.files.jsonlines import line_appender\n"
        "with line_appender(Path(sys.argv[1])) as append:\n"
        "    for n in range(40): append({'writer': sys.argv[2], 'n': n, 'long': 'x' * 20_000})"
    )
    children = [subprocess.Popen([sys.executable, "-c", program, str(path), name]) for name in ("a", "b")]
    assert [child.wait() for child in children] == [0, 0]
    records = list(read_lines(path))
    for name in ("a", "b"):
        assert [record["n"] for record in records if record["writer"] == name] == list(range(40))
