"""published.json says what a store said, and is not believed once it was changed."""

import pytest

from wsm_data.access.transfer.published import PUBLISHED_NAME, Published, PublishedFile, published_bytes, read_published
from wsm_data.errors import IntegrityError
from wsm_data.files.stores import open_store

PUBLISHED = Published(release="ab", files={"train-000000.tar": PublishedFile(size_bytes=3, checksum="etag:1")})


def test_what_was_written_is_read(tmp_path):
    (tmp_path / PUBLISHED_NAME).write_bytes(published_bytes(PUBLISHED))
    assert read_published(open_store(tmp_path)) == PUBLISHED


def test_where_nothing_was_published_nothing_is_read(tmp_path):
    assert read_published(open_store(tmp_path)) is None


def test_a_changed_byte_is_found(tmp_path):
    (tmp_path / PUBLISHED_NAME).write_bytes(published_bytes(PUBLISHED).replace(b"etag:1", b"etag:2"))
    with pytest.raises(IntegrityError, match="publish the release again"):
        read_published(open_store(tmp_path))
