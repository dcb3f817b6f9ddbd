import pytest

from wsm_data.access.shard_reader import Span, missing_shard, short_shard
from wsm_data.errors import IntegrityError


def test_a_span_ends_behind_its_last_byte():
    assert Span("train-000000.tar", 512, 100).end == 612


def test_a_missing_shard_is_an_integrity_error_that_names_it():
    error = missing_shard("/data/release", "train-000007.tar")
    assert isinstance(error, IntegrityError)
    assert str(error) == "train-000007.tar is missing from /data/release; fetch it again"


@pytest.mark.parametrize("found_bytes", [0, 40, 149])
def test_a_short_shard_is_named_with_what_it_lacks(found_bytes):
    error = short_shard("s3://bucket/release", Span("train-000007.tar", 50, 100), found_bytes)
    assert isinstance(error, IntegrityError)
    assert "train-000007.tar in s3://bucket/release must reach byte 150" in str(error)
    assert f"ends at byte {found_bytes}" in str(error)
