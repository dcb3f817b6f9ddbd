"""The kind of target follows from the URL."""

import pytest

from wsm_data.errors import ConfigError
from wsm_data.files.uploads.fsspec_target import FsspecTarget
from wsm_data.files.uploads.hub_target import HubTarget
from wsm_data.files.uploads.s3_target import S3Target
from wsm_data.files.uploads.target import open_target


def test_s3_the_hub_and_everything_else_have_targets_of_their_own():
    assert type(open_target("s3://bucket/release")) is S3Target
    assert type(open_target("hf://datasets/someone/homes")) is HubTarget
    assert type(open_target("memory://release")) is FsspecTarget


def test_a_url_that_nothing_knows_is_refused():
    with pytest.raises(ConfigError, match="cannot be opened"):
        open_target("nowhere://release")
