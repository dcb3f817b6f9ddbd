"""Files about a release: their digests, and their copies beside it."""

import errno
import os

import pytest

from pipelines.artifacts.release_files import content_digest, copy_into_release, warn_if_not_writable
from wsm_data.errors import ConfigError


def test_a_digest_is_the_published_one_of_the_empty_file_wherever_it_lies(tmp_path):
    (tmp_path / "empty").write_bytes(b"")
    xxh3_128_of_nothing = "99aa06d3014798d86001c324468d497f"  # from the reference implementation's test vectors
    assert content_digest(str(tmp_path / "empty"), "") == xxh3_128_of_nothing
    assert content_digest((tmp_path / "empty").as_uri(), "") == xxh3_128_of_nothing


def test_a_file_that_is_not_there_is_refused_in_the_words_of_who_asks(tmp_path):
    with pytest.raises(ConfigError, match=r"^run something first$"):
        content_digest(str(tmp_path / "absent"), "run something first")


def test_a_copy_replaces_other_bytes_and_leaves_equal_ones_untouched(tmp_path):
    (tmp_path / "made").write_bytes(b"new")
    copy = tmp_path / "release" / "sub" / "name"
    for _ in range(2):
        assert copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name") == copy
        assert copy.read_bytes() == b"new"
    before = copy.stat()
    copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name")
    assert copy.stat().st_ino == before.st_ino  # an atomic write would be another file
    (tmp_path / "made").write_bytes(b"newer")
    copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name")
    assert copy.read_bytes() == b"newer"


def test_nothing_is_written_behind_a_url_and_that_is_said_before(tmp_path, caplog):
    (tmp_path / "made").write_bytes(b"new")
    warn_if_not_writable("s3://bucket/release", "scores.parquet", "name it by its path")
    assert "scores.parquet will not be copied into s3://bucket/release (it lies behind a URL): name it" in caplog.text
    assert copy_into_release(tmp_path / "made", "s3://bucket/release", "scores.parquet") is None


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES])
def test_a_release_that_may_not_be_written_keeps_what_it_has_and_that_is_said_before(
    tmp_path, caplog, monkeypatch, number
):
    def refuse(**_):
        raise OSError(number, os.strerror(number))

    (tmp_path / "made").write_bytes(b"new")
    monkeypatch.setattr("pipelines.artifacts.release_files.TemporaryFile", refuse)
    warn_if_not_writable(str(tmp_path), "scores.parquet", "name it by its path")
    assert os.strerror(number) in caplog.text
    assert copy_into_release(tmp_path / "made", str(tmp_path), "scores.parquet") is None
    assert [path.name for path in tmp_path.iterdir()] == ["made"]


def test_a_full_disk_is_not_taken_for_a_read_only_release(tmp_path, monkeypatch):
    def refuse(**_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("pipelines.artifacts.release_files.TemporaryFile", refuse)
    with pytest.raises(OSError, match="No space left"):
        warn_if_not_writable(str(tmp_path), "scores.parquet", "")


def test_a_writable_release_is_no_word_worth_and_no_file_is_left(tmp_path, caplog):
    warn_if_not_writable(str(tmp_path), "scores.parquet", "")
    assert (caplog.text, list(tmp_path.iterdir())) == ("", [])
