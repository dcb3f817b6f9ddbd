"""Files about a release: their digests, and their copies beside it."""

import pytest

from pipelines.artifacts.release_files import content_digest, copy_into_release
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
        assert copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name", "") == copy
        assert copy.read_bytes() == b"new"
    before = copy.stat()
    copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name", "")
    assert copy.stat().st_ino == before.st_ino  # an atomic write would be another file
    (tmp_path / "made").write_bytes(b"newer")
    copy_into_release(tmp_path / "made", str(tmp_path / "release"), "sub/name", "")
    assert copy.read_bytes() == b"newer"


def test_nothing_is_written_behind_a_url_and_that_is_said(tmp_path, caplog):
    (tmp_path / "made").write_bytes(b"new")
    assert copy_into_release(tmp_path / "made", "s3://bucket/release", "scores.parquet", "") is None
    assert "is not copied to s3://bucket/release: put it there as scores.parquet" in caplog.text


def test_a_release_that_may_not_be_written_is_a_warning(tmp_path, caplog, monkeypatch):
    (tmp_path / "made").write_bytes(b"new")

    def refuse(path, data):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pipelines.artifacts.release_files.write_bytes", refuse)
    assert copy_into_release(tmp_path / "made", str(tmp_path), "scores.parquet", "name it by its path") is None
    assert "cannot be copied into its release" in caplog.text
    assert "name it by its path" in caplog.text
