"""The kind of target follows from the URL."""

import pytest

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.files.uploads.hub_target import HubTarget
from wsm_data.files.uploads.local_file import look_at
from wsm_data.files.uploads.s3_target import S3Target
from wsm_data.files.uploads.target import open_target, send


def test_s3_the_hub_and_everything_else_have_targets_of_their_own():
    assert type(open_target("s3://bucket/release")) is S3Target
    assert type(open_target("hf://datasets/someone/homes")) is HubTarget
    assert type(open_target("memory://release")) is FsspecTarget


def test_a_url_that_nothing_knows_is_refused():
    with pytest.raises(ConfigError, match="cannot be opened"):
        open_target("nowhere://release")


def test_a_file_is_sent_once(tmp_path):
    (tmp_path / "a").write_bytes(b"some bytes")
    file = look_at(tmp_path / "a", 1 << 20)
    target = open_target(f"memory://sent-{tmp_path.name}")
    assert [send(target, "a", file), send(target, "a", file)] == [True, False]


def test_a_bucket_that_is_not_there_takes_nothing(store_proxy, tmp_path):
    (tmp_path / "a").write_bytes(b"some bytes")
    with pytest.raises(StoreError, match="s3://absent-bucket/release takes no files"):
        send(open_target("s3://absent-bucket/release"), "a", look_at(tmp_path / "a", 1 << 20))
