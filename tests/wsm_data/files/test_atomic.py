"""Files that exist whole or not at all, whatever happens to the writer."""

import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from wsm_data.files.atomic import TEMPORARY_SUFFIX, atomic_file, remove_temporaries, write_bytes, write_text

_WRITE_HALF_AND_WAIT = """
import sys, time
from pathlib import Path
from wsm_data.files.atomic import atomic_file
with atomic_file(Path(sys.argv[1])) as file:
    file.write(b"half of the new content")
    file.flush()
    print("written", flush=True)
    time.sleep(60)
"""


def temporaries(folder):
    return sorted(path.name for path in folder.rglob(f"*{TEMPORARY_SUFFIX}"))


def test_the_file_appears_with_its_whole_content_and_nothing_beside_it(tmp_path):
    write_bytes(tmp_path / "a.bin", b"\x00\xff" * 1000)
    assert (tmp_path / "a.bin").read_bytes() == b"\x00\xff" * 1000
    assert [path.name for path in tmp_path.iterdir()] == ["a.bin"]


def test_missing_folders_are_made(tmp_path):
    write_text(tmp_path / "new" / "folder" / "a.txt", "text")
    assert (tmp_path / "new" / "folder" / "a.txt").read_text() == "text"


def test_text_is_utf_8(tmp_path):
    write_text(tmp_path / "a.txt", "3 µm")
    assert (tmp_path / "a.txt").read_bytes() == b"3 \xc2\xb5m"


def test_readers_see_the_old_content_until_the_body_has_ended(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with atomic_file(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"


def test_a_reader_that_has_the_old_file_open_reads_it_to_its_end(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with path.open() as reader:
        write_text(path, "new")
        assert reader.read() == "old"


def test_the_bytes_are_on_disk_before_the_name_and_the_name_before_the_return(tmp_path, monkeypatch):
    events = []
    fsync, replace = os.fsync, Path.replace

    def noted_fsync(descriptor):
        events.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
        fsync(descriptor)

    def noted_replace(self, target):
        events.append("rename")
        return replace(self, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(Path, "replace", noted_replace)
    write_text(tmp_path / "a.txt", "text")
    assert events == ["file", "rename", "folder"]


@pytest.mark.parametrize("interruption", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_body_that_raises_leaves_the_old_content_and_no_temporary(tmp_path, interruption):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    with pytest.raises(interruption):
        write_half_and_raise(path, interruption)
    assert path.read_text() == "old"
    assert temporaries(tmp_path) == []


def test_a_body_that_raises_leaves_no_file_where_there_was_none(tmp_path):
    with pytest.raises(ValueError, match="on purpose"):
        write_half_and_raise(tmp_path / "a.txt", ValueError("on purpose"))
    assert list(tmp_path.iterdir()) == []


def test_two_writers_of_one_path_in_one_process_do_not_mix(tmp_path):
    path = tmp_path / "a.bin"
    both_open = threading.Barrier(2)

    def write(letter):
        with atomic_file(path) as file:
            both_open.wait(timeout=120)
            for _ in range(100):
                file.write(letter * 1000)

    threads = [threading.Thread(target=write, args=(letter,)) for letter in (b"a", b"b")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert path.read_bytes() in (b"a" * 100_000, b"b" * 100_000)
    assert temporaries(tmp_path) == []


def test_two_processes_writing_one_path_do_not_mix(tmp_path):
    path = tmp_path / "a.bin"
    child = start_half_writer(path)
    try:
        write_text(path, "the other process's content")
        assert path.read_text() == "the other process's content"
        assert len(temporaries(tmp_path)) == 1
    finally:
        stop(child)


def test_a_kill_in_mid_write_leaves_the_old_content_and_a_temporary_that_can_be_cleaned(tmp_path):
    path = tmp_path / "a.txt"
    write_text(path, "old")
    stop(start_half_writer(path))
    assert path.read_text() == "old"
    assert len(temporaries(tmp_path)) == 1
    assert remove_temporaries(tmp_path) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]


def test_cleaning_looks_into_subfolders_and_touches_nothing_else(tmp_path):
    for name in (
        ".a.tar.0123456789abcdef.partial",
        "sub/.b.npy.0123456789abcdef.partial",
        "sub/report.partial",
        ".hidden",
    ):
        write_text(tmp_path / name, "x")
    assert remove_temporaries(tmp_path) == 2
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == [".hidden", "report.partial"]


def test_cleaning_a_folder_that_does_not_exist_finds_nothing(tmp_path):
    assert remove_temporaries(tmp_path / "absent") == 0


def test_the_file_gets_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "plain").write_bytes(b"")
    write_bytes(tmp_path / "atomic", b"")
    assert (tmp_path / "atomic").stat().st_mode == (tmp_path / "plain").stat().st_mode


def write_half_and_raise(path, interruption):
    with atomic_file(path) as file:
        file.write(b"half of the new content")
        raise interruption


def start_half_writer(path):
    command = [sys.executable, "-c", _WRITE_HALF_AND_WAIT, str(path)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "written\n"
    return child


def stop(child):
    child.send_signal(signal.SIGKILL)
    child.communicate()
    assert child.returncode == -signal.SIGKILL
