import gzip

import pytest

from wsm_data.readers.archive.gzip_tail import ends_like_a_tar


@pytest.mark.parametrize(("size", "like"), [(10_240, True), (512, True), (511, False), (10_241, False)])
def test_the_length_at_the_end_of_a_gzip_stream_is_whole_blocks_of_a_tar(tmp_path, size, like):
    (tmp_path / "a").write_bytes(gzip.compress(bytes(size)))
    assert ends_like_a_tar(tmp_path / "a", "a") is like


def test_a_file_too_short_for_a_length_does_not_end_like_a_tar(tmp_path):
    (tmp_path / "a").write_bytes(b"\0\0\0")
    assert not ends_like_a_tar(tmp_path / "a", "a")
