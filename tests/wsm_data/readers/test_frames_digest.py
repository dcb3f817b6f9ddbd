import hashlib
from types import SimpleNamespace

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.files.digest import xxh3_128
from wsm_data.readers.frames_digest import ABSENT, digest_frames, verified_frames


def record_of(rgb, depth):
    digest = digest_frames([xxh3_128(one) for one in rgb], [ABSENT if one is None else xxh3_128(one) for one in depth])
    return SimpleNamespace(frames_digest=digest, container="c", id=SimpleNamespace(text="g/s/e"))


def test_the_digest_of_frames_goes_by_time_and_tells_colour_from_depth():
    assert digest_frames(["a", "b"], ["c", "d"]) == hashlib.sha256(b"acbd").hexdigest()
    assert digest_frames(["a", "b"], ["c", "d"]) != digest_frames(["b", "a"], ["c", "d"])


def test_frames_come_back_as_they_were_read_with_absent_depth_as_none():
    frames = verified_frames(record_of([b"a", b"b"], [b"c", None]), [b"a", b"b"], [b"c", None])
    assert (list(frames.rgb), list(frames.depth)) == ([b"a", b"b"], [b"c", None])


@pytest.mark.parametrize(("rgb", "depth"), [([b"x", b"b"], [b"c", None]), ([b"a", b"b"], [b"c", b"d"])])
def test_a_changed_or_added_image_is_an_integrity_error(rgb, depth):
    with pytest.raises(IntegrityError, match=r"c changed since .* g/s/e"):
        verified_frames(record_of([b"a", b"b"], [b"c", None]), rgb, depth)
