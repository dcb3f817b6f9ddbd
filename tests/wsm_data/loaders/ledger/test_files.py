import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.files.journal import JournalWriter
from wsm_data.loaders.ledger.files import ledger_file_name, ledger_files, read_ledger_file, read_session
from wsm_data.loaders.ledger.writer import LedgerWriter

REFS = [[3, 1], [], [7], [0, 2]]


@pytest.fixture
def path(tmp_path):
    """A file of two starts in one epoch, with the steps of `REFS` after the first and two of them after the second."""
    with LedgerWriter(tmp_path / "ledger", {"seed": 5}, 1, 2) as writer:
        writer.begin(2, 0, 6)
        for step, refs in enumerate(REFS):
            writer.record(2, step, np.array(refs, np.int64))
        writer.begin(2, 1, 6)
        for step in (1, 2):
            writer.record(2, step, np.array(REFS[step], np.int64))
    [path] = ledger_files(tmp_path / "ledger").values()
    return path


def test_what_was_written_is_read(path):
    file = read_ledger_file(path)
    assert (file.rank, file.world_size, file.identity, file.closed, file.torn_bytes) == (1, 2, {"seed": 5}, True, 0)
    assert [(one.epoch, one.start, one.steps, one.end) for one in file.segments] == [(2, 0, 6, 4), (2, 1, 6, 3)]
    assert [refs.tolist() for refs in file.segments[0].refs] == REFS
    assert read_session(path)["session"] == file.session


def test_a_kill_at_any_byte_leaves_whole_records_and_a_torn_one_at_most(path):
    data = path.read_bytes()
    seen = []
    for size in range(len(data)):
        path.write_bytes(data[:size])
        file = read_ledger_file(path)
        if file is None:
            assert read_session(path) is None
            assert not seen
        else:
            seen.append(sum(len(segment.refs) for segment in file.segments))
            assert not file.closed
    assert seen == sorted(seen)
    assert set(seen) == set(range(7))


def test_a_file_of_zeros_has_no_head(path):
    path.write_bytes(bytes(512))  # what a power cut leaves
    assert read_ledger_file(path) is None
    assert read_session(path) is None


def test_a_changed_byte_is_refused_with_its_line(path):
    data = path.read_bytes()
    path.write_bytes(data.replace(b'"step":2', b'"step":3', 1))
    with pytest.raises(IntegrityError, match=r"rank-00001\.jsonl:5 must have the checksum"):
        read_ledger_file(path)


def test_steps_that_were_swapped_are_refused(path):
    lines = path.read_bytes().splitlines(keepends=True)
    lines[2], lines[4] = lines[4], lines[2]
    path.write_bytes(b"".join(lines))
    with pytest.raises(IntegrityError, match=r"step 0 of epoch 2 must follow, found step 2 of epoch 2; restore"):
        read_ledger_file(path)


def test_another_version_is_refused_by_name(tmp_path):
    for found, record in (("3", {"version": 3}), ("none", {"closed": True})):
        with JournalWriter(tmp_path, f"rank-0000{found[0]}") as journal:
            journal.append(record)
        for read in (read_session, read_ledger_file):
            with pytest.raises(IntegrityError, match=f"version 2, found {found}; restore the file or use a matching"):
                read(tmp_path / f"rank-0000{found[0]}.jsonl")


def test_a_ledger_of_the_version_before_is_refused_by_name(tmp_path):
    (tmp_path / "rank-00000-000000.ledger").write_bytes(b"SESS")
    with pytest.raises(IntegrityError, match="older version of the ledger, 2 is needed; use the wsm that wrote it"):
        ledger_files(tmp_path)


@given(st.lists(st.tuples(st.integers(0, 200_000), st.integers(0, 2_000_000)), unique=True, max_size=8))
def test_files_come_by_rank_and_then_in_the_order_in_which_they_were_begun(tmp_path_factory, numbers):
    folder = tmp_path_factory.mktemp("names")
    for rank, number in numbers:
        (folder / ledger_file_name(rank, number)).touch()
    (folder / "notes.txt").touch()
    assert list(ledger_files(folder)) == sorted(numbers)


def test_a_folder_that_is_not_there_has_no_files(tmp_path):
    assert ledger_files(tmp_path / "nothing") == {}
