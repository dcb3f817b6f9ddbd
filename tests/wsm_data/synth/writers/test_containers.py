import gzip
import subprocess
import sys
import tarfile

import pytest

from wsm_data.synth.writers.containers import write_archive, write_folder

MEMBERS = [("meta/a.json", b"{}"), ("data/b.bin", bytes(range(256)) * 9), ("empty", b"")]


def failing():
    yield "meta/a.json", b"{}"
    raise OSError("no space left on device")


def test_an_archive_holds_the_members_below_its_top_folder(tmp_path):
    path = tmp_path / "group" / "scene.tar.gz"
    write_archive(path, "scene", MEMBERS, 1)
    with tarfile.open(path) as archive:
        found = {info.name: archive.extractfile(info).read() for info in archive}
    assert found == {f"scene/{name}": data for name, data in MEMBERS}
    assert len(gzip.decompress(path.read_bytes())) % 10240 == 0  # whole records, as tar writes them


def test_equal_members_give_equal_archives_without_time_or_name(tmp_path):
    for name in ("one.tar.gz", "two.tar.gz"):
        write_archive(tmp_path / name, "scene", MEMBERS, 1)
    assert (tmp_path / "one.tar.gz").read_bytes() == (tmp_path / "two.tar.gz").read_bytes()
    header = (tmp_path / "one.tar.gz").read_bytes()[:10]
    assert header[3] == 0  # no name
    assert header[4:8] == bytes(4)  # no time
    with tarfile.open(tmp_path / "one.tar.gz") as archive:
        assert {(info.mtime, info.uid, info.gid, info.mode) for info in archive} == {(0, 0, 0, 0o644)}


def test_a_folder_holds_the_members_and_replaces_an_older_one(tmp_path):
    path = tmp_path / "scene"
    write_folder(path, [("old", b"1")])
    write_folder(path, MEMBERS)
    found = {file.relative_to(path).as_posix(): file.read_bytes() for file in path.rglob("*") if file.is_file()}
    assert found == dict(MEMBERS)


def test_what_a_killed_writer_left_is_removed_by_the_next(tmp_path):
    killed = "import os, sys; from pathlib import Path; from wsm_data.synth.writers.containers import write_folder\n"
    killed += "write_folder(Path(sys.argv[1]), (('a', b'1') if n < 3 else os._exit(9) for n in range(9)))"
    done = subprocess.run([sys.executable, "-c", killed, str(tmp_path / "scene")])
    assert done.returncode == 9
    assert [path.name for path in tmp_path.iterdir()] != ["scene"]
    assert len(list(tmp_path.rglob("*"))) == 2  # the temporary folder and a file in it
    write_folder(tmp_path / "scene", MEMBERS)
    assert [path.name for path in tmp_path.iterdir()] == ["scene"]
    assert not (tmp_path / "scene" / "a").exists()


def test_what_fails_half_way_leaves_the_old_state_and_nothing_else(tmp_path):
    write_folder(tmp_path / "scene", [("old", b"1")])
    with pytest.raises(OSError, match="no space"):
        write_folder(tmp_path / "scene", failing())
    with pytest.raises(OSError, match="no space"):
        write_archive(tmp_path / "scene.tar.gz", "scene", failing(), 1)
    assert [path.relative_to(tmp_path).as_posix() for path in sorted(tmp_path.rglob("*"))] == ["scene", "scene/old"]
