import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.loaders.ledger.files import framed, ledger_files, read_ledger_file, read_session
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


@pytest.mark.parametrize("cut", [0, 3, 16, 20, 45])
def test_zeros_behind_the_last_bytes_are_what_a_power_cut_leaves(path, cut):
    data = path.read_bytes()  # it ends with DONE, 16 bytes, and the 40 bytes of the last step
    path.write_bytes(data[: len(data) - cut] + bytes(4096))
    file = read_ledger_file(path)
    assert [len(segment.refs) for segment in file.segments] == [4, 2 if cut <= 16 else 1]
    assert file.closed == (cut == 0)


def test_a_file_of_zeros_has_no_head(path):
    path.write_bytes(bytes(512))
    assert read_ledger_file(path) is None
    assert read_session(path) is None


def found_in(path):
    """What is read of a file's steps, or its refusal."""
    try:
        file = read_ledger_file(path)
    except IntegrityError as error:
        return str(error)
    return [refs.tolist() for segment in file.segments for refs in segment.refs] if file else []


def test_no_changed_byte_is_taken_for_what_was_written(path):
    data, whole = path.read_bytes(), found_in(path)
    for place in range(len(data)):
        path.write_bytes(data[:place] + bytes([data[place] ^ 0x41]) + data[place + 1 :])
        found = found_in(path)
        if isinstance(found, str):
            assert str(path) in found
        else:  # the size of the last record, DONE: it looks like one that was cut short
            assert found == whole
            assert len(data) - 12 <= place < len(data) - 8


@pytest.mark.parametrize("size", [41, 200, 5000, 1 << 28, (1 << 32) - 1])
@pytest.mark.parametrize("tag", [b"SESS", b"STRT", b"STEP"])
def test_a_size_that_reaches_past_the_end_does_not_hide_the_records_behind_it(path, tag, size):
    data = path.read_bytes()
    place = data.index(tag) + len(tag)
    path.write_bytes(data[:place] + struct.pack("<I", size) + data[place + 4 :])
    with pytest.raises(IntegrityError, match=f"at byte {place - 4} must have the size and the checksum"):
        read_ledger_file(path)
    if tag == b"SESS":
        with pytest.raises(IntegrityError, match="at byte 0 must have the size"):
            read_session(path)


def test_the_size_of_the_last_record_alone_can_make_it_look_cut_short(path):
    data = path.read_bytes()[:-16]  # without DONE, the last step is the last record
    place = data.rindex(b"STEP") + 4
    path.write_bytes(data[:place] + struct.pack("<I", 5000) + data[place + 4 :])
    file = read_ledger_file(path)
    assert [len(segment.refs) for segment in file.segments] == [4, 1]
    assert file.torn_bytes == len(data) - place + 4


def test_steps_that_were_swapped_are_refused(path):
    data = path.read_bytes()
    steps = [framed(b"STEP", struct.pack("<qq", 2, step) + np.array(REFS[step], "<i8").tobytes()) for step in (0, 2)]
    path.write_bytes(data.replace(steps[0], b"?", 1).replace(steps[1], steps[0], 1).replace(b"?", steps[1], 1))
    with pytest.raises(IntegrityError, match=r"step 0 of epoch 2 must follow, found step 2 of epoch 2; restore"):
        read_ledger_file(path)


def test_another_version_is_refused_by_name(path):
    path.write_bytes(framed(b"SESS", b'{"version":2}'))
    for read in (read_session, read_ledger_file):
        with pytest.raises(IntegrityError, match=r"version 1, found 2; restore the file or use a matching wsm"):
            read(path)
    path.write_bytes(framed(b"DONE", b""))
    with pytest.raises(IntegrityError, match="version 1, found none"):
        read_session(path)


@given(st.lists(st.tuples(st.integers(0, 200_000), st.integers(0, 2_000_000)), unique=True, max_size=8))
def test_files_come_by_rank_and_then_in_the_order_in_which_they_were_begun(tmp_path_factory, numbers):
    folder = tmp_path_factory.mktemp("names")
    for rank, number in numbers:
        (folder / f"rank-{rank:05d}-{number:06d}.ledger").touch()
    (folder / "notes.txt").touch()
    assert list(ledger_files(folder)) == sorted(numbers)


def test_a_folder_that_is_not_there_has_no_files(tmp_path):
    assert ledger_files(tmp_path / "nothing") == {}
