import gzip
import io
import os
import tarfile
import zipfile

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from zlib_ng import zlib_ng

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.tar_stream import open_tar

CONTENT = np.arange(750_000, dtype=">u4").tobytes()


@settings(max_examples=30)
@given(steps=st.lists(st.tuples(st.integers(0, 900_000), st.booleans()), max_size=12))
def test_taking_and_skipping_reads_the_content_in_order(tmp_path_factory, steps):
    """3 MB through a buffer of half a MiB: pieces straddle its end, and some are larger than what is left of it."""
    path = tmp_path_factory.getbasetemp() / "content.gz"
    if not path.exists():
        path.write_bytes(gzip.compress(CONTENT, 1))
    position = 0
    with open_tar(path, "a") as stream:
        for size, skip in steps:
            size = min(size, len(CONTENT) - position)
            if skip:
                stream.skip(size)
            else:
                assert stream.take(size) == CONTENT[position : position + size]
            position += size
            assert stream.position == position
        assert b"".join(bytes(piece) for piece in stream.rest()) == CONTENT[position:]


def test_without_the_direct_reader_the_public_one_gives_the_same(tmp_path, monkeypatch):
    path = tmp_path / "content.gz"
    path.write_bytes(gzip.compress(CONTENT, 1))
    monkeypatch.delattr(zlib_ng, "_GzipReader")
    with open_tar(path, "a") as stream:
        stream.skip(1000)
        assert stream.take(900_000) == CONTENT[1000:901_000]
        assert b"".join(bytes(piece) for piece in stream.rest()) == CONTENT[901_000:]


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda data: data[:-9], Reason.ARCHIVE_TRUNCATED),
        (lambda data: data[:-8] + bytes(8), Reason.ARCHIVE_CORRUPT),
    ],
)
@pytest.mark.parametrize("direct", [True, False])
def test_both_readers_refuse_damage_alike(tmp_path, monkeypatch, direct, damage, reason):
    path = tmp_path / "content.gz"
    path.write_bytes(damage(gzip.compress(CONTENT, 1)))
    if not direct:
        monkeypatch.delattr(zlib_ng, "_GzipReader")
    with pytest.raises(DataError) as caught, open_tar(path, "a") as stream:
        list(stream.rest())
    assert caught.value.reason is reason


def zip_bytes():
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("a/b", b"content")
    return buffer.getvalue()


def tar_bytes(mode):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode=mode) as archive:
        archive.addfile(tarfile.TarInfo("a/b"))
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (zip_bytes(), "zip"),
        (tar_bytes("w:bz2"), "bzip2"),
        (tar_bytes("w:xz"), "xz"),
        (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
        (b"Rar!\x1a\x07", "RAR"),
    ],
)
def test_another_kind_of_archive_is_to_be_packed_anew_and_not_downloaded_again(tmp_path, data, kind):
    path = tmp_path / "a"
    path.write_bytes(data)
    with (
        pytest.raises(DataError, match=f"must be a .tar, .tar.gz, .tgz or .tar.zst, and is a {kind} archive") as caught,
        open_tar(path, "a"),
    ):
        pass
    assert caught.value.reason is Reason.ARCHIVE_UNREAD_FORM
    assert "download it again" not in caught.value.message


def test_what_is_no_archive_is_to_be_downloaded_again(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"<html>not found</html>")
    with pytest.raises(DataError, match="download it again"), open_tar(path, "a"):
        pass


def zstd(data):
    return pa.compress(data, "zstd", asbytes=True)


@pytest.mark.parametrize("pack", [gzip.compress, zstd, bytes])
def test_a_tar_gives_the_same_bytes_however_it_is_compressed(tmp_path, pack):
    path, content = tmp_path / "a", tar_bytes("w") + CONTENT
    path.write_bytes(pack(content))
    with open_tar(path, "a") as stream:
        stream.skip(1000)
        assert stream.take(900_000) == content[1000:901_000]
        assert b"".join(bytes(piece) for piece in stream.rest()) == content[901_000:]


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda data: data[:-9], Reason.ARCHIVE_TRUNCATED),
        (lambda data: data[:9] + b"\xff" * 100 + data[109:], Reason.ARCHIVE_CORRUPT),
    ],
)
def test_a_damaged_zstandard_stream_is_refused(tmp_path, damage, reason):
    path = tmp_path / "a"
    path.write_bytes(damage(zstd(CONTENT)))
    with pytest.raises(DataError) as caught, open_tar(path, "a") as stream:
        list(stream.rest())
    assert caught.value.reason is reason


def test_a_pipe_is_refused_without_being_opened(tmp_path):
    os.mkfifo(tmp_path / "a")
    with pytest.raises(DataError) as caught, open_tar(tmp_path / "a", "a"):
        pass
    assert caught.value.reason is Reason.FILE_NOT_REGULAR
