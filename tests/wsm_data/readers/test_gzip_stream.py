import gzip

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.readers.gzip_stream import open_gzip

CONTENT = np.arange(750_000, dtype=">u4").tobytes()


@settings(max_examples=30)
@given(steps=st.lists(st.tuples(st.integers(0, 900_000), st.booleans()), max_size=12))
def test_taking_and_skipping_reads_the_content_in_order(tmp_path_factory, steps):
    """3 MB through a buffer of half a MiB: pieces straddle its end, and some are larger than what is left of it."""
    path = tmp_path_factory.getbasetemp() / "content.gz"
    if not path.exists():
        path.write_bytes(gzip.compress(CONTENT, 1))
    position = 0
    with open_gzip(path, "a") as stream:
        for size, skip in steps:
            size = min(size, len(CONTENT) - position)
            if skip:
                stream.skip(size)
            else:
                assert stream.take(size) == CONTENT[position : position + size]
            position += size
            assert stream.position == position
        assert b"".join(bytes(piece) for piece in stream.rest()) == CONTENT[position:]
