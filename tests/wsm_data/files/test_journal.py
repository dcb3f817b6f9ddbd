"""Journals: what a kill, a power cut and a changed byte leave behind, and the one order of several writers."""

import errno
import json
import os
import signal
import subprocess
import sys

import pytest
import xxhash
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.files.journal import (
    JournalWriter,
    file_name,
    journal_files,
    read_journal,
    read_records,
    rewrite_journal,
    torn_bytes,
)

RECORDS = [{"n": 0, "facts": {"words": ["a", "\u2028"], "share": 0.1}}, {"n": 1}, {"n": 2, "xxh3": "taken"}]


def write(folder, *records, name="a"):
    with JournalWriter(folder, name) as journal:
        for record in records:
            journal.append(record)


@pytest.fixture
def path(tmp_path):
    write(tmp_path, {"n": 0, "word": "one"}, {"n": 1}, {"n": 2})
    return tmp_path / "a.jsonl"


def test_a_line_is_the_canonical_record_and_its_checksum_as_the_last_member(tmp_path):
    write(tmp_path, {"n": 1, "b": [2.0]})
    line = (tmp_path / "a.jsonl").read_text()
    checksum = xxhash.xxh3_64_hexdigest(b'{"b":[2.0],"n":1}')
    assert line == f'{{"b":[2.0],"n":1,"xxh3":"{checksum}"}}\n'
    assert json.loads(line) == {"b": [2.0], "n": 1, "xxh3": checksum}


def test_records_are_read_as_they_were_written(tmp_path):
    write(tmp_path, *RECORDS)
    assert list(read_records(tmp_path / "a.jsonl")) == RECORDS


@given(st.lists(st.dictionaries(st.text(), st.integers() | st.text(), min_size=1, max_size=3), max_size=4))
def test_any_record_is_read_back(tmp_path_factory, records):
    folder = tmp_path_factory.mktemp("journal")
    write(folder, *records)
    assert list(read_journal(folder, "a")) == records


def test_nothing_is_created_before_the_first_record(tmp_path):
    write(tmp_path / "new")
    assert not (tmp_path / "new").exists()
    assert list(read_journal(tmp_path / "new", "a")) == []
    assert journal_files(tmp_path / "new") == {}


def test_every_writer_has_a_file_of_its_own_and_they_are_read_by_number_and_name(tmp_path):
    first, second = JournalWriter(tmp_path, "a"), JournalWriter(tmp_path, "a")
    first.append({"n": 0})
    second.append({"n": 2})
    first.append({"n": 1})
    write(tmp_path, {"n": 9}, name="a-b")
    first.close()
    second.close()
    write(tmp_path, {"n": 3})
    assert [path.name for path in journal_files(tmp_path).values()] == [
        "a.jsonl",
        "a.000001.jsonl",
        "a.000002.jsonl",
        "a-b.jsonl",
    ]
    assert [record["n"] for record in read_journal(tmp_path, "a")] == [0, 1, 2, 3]


def test_two_writers_that_take_the_same_number_at_the_same_time_do_not_share_a_file(tmp_path, monkeypatch):
    first = JournalWriter(tmp_path, "a")
    first.append({"n": 0})
    with monkeypatch.context() as patch:
        patch.setattr("wsm_data.files.journal.journal_files", lambda _: {})  # a listing from before the other's file
        write(tmp_path, {"n": 1})
    first.append({"n": 2})
    first.close()
    assert [record["n"] for record in read_records(tmp_path / "a.jsonl")] == [0, 2]
    assert [record["n"] for record in read_records(tmp_path / "a.000001.jsonl")] == [1]


@given(st.lists(st.tuples(st.sampled_from(["a", "b-1"]), st.integers(0, 2_000_000)), unique=True, max_size=8))
def test_files_come_by_name_and_number_and_nothing_else_is_one(tmp_path_factory, numbers):
    folder = tmp_path_factory.mktemp("names")
    for name, number in numbers:
        (folder / file_name(name, number)).touch()
    for other in ("a.txt", "a.1.jsonl", ".a.jsonl", "a.jsonl.partial"):
        (folder / other).touch()
    assert list(journal_files(folder)) == sorted(numbers)


def test_a_kill_at_any_byte_leaves_whole_records(path):
    data = path.read_bytes()
    ends = [place + 1 for place, byte in enumerate(data) if byte == ord("\n")]
    for size in range(len(data) + 1):
        path.write_bytes(data[:size])
        assert [record["n"] for record in read_records(path)] == list(range(sum(end <= size for end in ends)))
        assert torn_bytes(path) == size - max((end for end in ends if end <= size), default=0)


@pytest.mark.parametrize("cut", [0, 1, 20])
def test_zeros_behind_the_last_bytes_are_what_a_power_cut_leaves(path, cut):
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - cut] + bytes(4096))
    assert [record["n"] for record in read_records(path)] == [0, 1, 2][: 3 if cut == 0 else 2]


def test_no_changed_byte_is_taken_for_what_was_written(path):
    data, whole = path.read_bytes(), list(read_records(path))
    for place in range(len(data)):
        for flip in (0x01, 0x41, data[place] ^ ord("\n")):
            path.write_bytes(data[:place] + bytes([data[place] ^ flip]) + data[place + 1 :])
            if flip and place < len(data) - 1:
                with pytest.raises(IntegrityError, match=r"a\.jsonl:\d"):
                    list(read_records(path))
    path.write_bytes(data[:-1] + b" ")  # the last line break alone can be lost, which looks like a kill
    assert list(read_records(path)) == whole[:-1]


def test_lines_that_were_swapped_with_another_checksum_are_refused(path):
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[1][:-28] + lines[2][-28:])
    with pytest.raises(IntegrityError, match="must have the checksum that was written with it"):
        list(read_records(path))


def test_a_file_of_plain_lines_is_read_and_goes_on_in_a_second_file(tmp_path):
    (tmp_path / "a.jsonl").write_bytes(b'{"n":0}\n{"n":1}\n{"n"')
    write(tmp_path, {"n": 2})
    assert [record["n"] for record in read_journal(tmp_path, "a")] == [0, 1, 2]


def test_a_plain_line_among_those_with_checksums_is_refused(path):
    with path.open("ab") as file:
        file.write(b'{"n":3}\n')
    with pytest.raises(IntegrityError, match=r"a\.jsonl:4 must have the checksum"):
        list(read_records(path))


def test_what_was_appended_survives_the_death_of_its_writer(tmp_path):
    program = (
        "import os, sys; from pathlib import Path; from wsm_data.files.journal import JournalWriter\n"
        "JournalWriter(Path(sys.argv[1]), 'a').append({'n': 1})\nos.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", program, str(tmp_path)]).returncode == -signal.SIGKILL
    assert list(read_journal(tmp_path, "a")) == [{"n": 1}]


def test_records_are_brought_to_disk_now_and_then_and_at_the_end(tmp_path, monkeypatch):
    times = iter([0.0, 0.1, 0.15, 0.25, 0.25, 0.3])  # opening, two lines, a late line asks twice, one more line
    monkeypatch.setattr("time.monotonic", lambda: next(times))
    monkeypatch.setattr("wsm_data.files.journal.flush_folder", lambda _: None)
    synced = []
    monkeypatch.setattr(os, "fsync", lambda _: synced.append((tmp_path / "a.jsonl").read_bytes().count(b"\n")))
    with JournalWriter(tmp_path, "a", sync_every_s=0.2) as journal:
        for number in range(4):
            journal.append({"n": number})
    assert synced == [3, 4]


class FullDisk:
    """A file that takes half of what it is given."""

    name = "full"

    def __init__(self, file):
        self._file = file

    def write(self, data):
        return self._file.write(data[: len(data) // 2])

    def __getattr__(self, name):
        return getattr(self._file, name)


def test_no_record_follows_one_that_was_cut_short(tmp_path, monkeypatch):
    journal = JournalWriter(tmp_path, "a")
    journal.append({"n": 0})
    with monkeypatch.context() as patch:
        patch.setattr(journal, "_file", FullDisk(journal._file))
        with pytest.raises(OSError) as stopped:  # noqa: PT011  # the number of the error is what counts
            journal.append({"n": 1})
    assert stopped.value.errno == errno.ENOSPC
    with pytest.raises(OSError, match="none can follow it"):
        journal.append({"n": 2})
    journal.close({"closed": True})
    assert list(read_journal(tmp_path, "a")) == [{"n": 0}]


def test_a_last_record_says_that_the_writer_was_closed_and_the_next_opens_another_file(tmp_path):
    journal = JournalWriter(tmp_path, "a")
    journal.close({"closed": True})
    for _ in range(2):
        journal.append({"n": 0})
        journal.close({"closed": True})
        journal.close({"closed": True})
    assert list(read_records(tmp_path / "a.000001.jsonl")) == [{"n": 0}, {"closed": True}]
    assert len(journal_files(tmp_path)) == 2


def test_a_rewritten_journal_is_one_file(tmp_path):
    for number in range(3):
        write(tmp_path, {"n": number})
    write(tmp_path, {"n": 7}, name="b")
    rewrite_journal(tmp_path, "a", [{"n": 2}, {"n": 0}])
    assert [path.name for path in journal_files(tmp_path).values()] == ["a.jsonl", "b.jsonl"]
    assert list(read_journal(tmp_path, "a")) == [{"n": 2}, {"n": 0}]


@pytest.mark.parametrize("deleted", [0, 1, 2, 3])
def test_killed_while_it_is_rewritten_a_journal_has_the_same_last_words(tmp_path, monkeypatch, deleted):
    for number in range(4):
        write(tmp_path, {"unit": "a", "n": number}, {"unit": "b" if number % 2 else "c", "n": number})
    wanted = {record["unit"]: record for record in read_journal(tmp_path, "a")}
    left = iter([None] * deleted)
    unlink = type(tmp_path).unlink

    def dying(path, *args, **kwargs):
        if path.suffix == ".jsonl":
            next(left)
        unlink(path, *args, **kwargs)

    monkeypatch.setattr(type(tmp_path), "unlink", dying)
    try:
        rewrite_journal(tmp_path, "a", wanted.values())
    except StopIteration:
        assert deleted < 3
    assert {record["unit"]: record for record in read_journal(tmp_path, "a")} == wanted
