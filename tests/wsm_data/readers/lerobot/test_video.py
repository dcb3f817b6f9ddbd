import sys
from pathlib import Path

import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.lerobot.video import VideoPart, decoded, depth_codes, packets_digest, rgb_u8

sys.path.insert(0, str(Path(__file__).parents[2] / "fakes"))

RGB, DEPTH = "observation.images.rgb", "observation.images.depth"


def part(root, key, times_s, **changes):
    (path,) = sorted((root / "videos").glob(f"**/{key}/**/*.mp4"))[:1]
    whole = {"path": path, "where": "here", "times_s": np.array(times_s), "tolerance_s": 0.04, "max_pixels": 1 << 20}
    return VideoPart(**{**whole, **changes})


def test_frames_at_given_times_are_those_of_the_whole_video_decoded_in_order(lerobot_root):
    import av

    wanted = part(lerobot_root, RGB, [0.1, 0.3, 0.5])
    with av.open(str(wanted.path)) as container:
        every = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    for frame, number in zip(decoded(wanted, rgb_u8), (1, 3, 5), strict=True):
        assert np.array_equal(frame, every[number])


def test_depth_codes_are_those_that_were_written(lerobot_root, walks):
    from lerobot_set import quantised

    for frame, depth_m in zip(
        decoded(part(lerobot_root, DEPTH, [0.2, 0.4]), depth_codes), walks[0].depth_m[2::2], strict=True
    ):
        assert np.array_equal(frame, quantised(depth_m))


def test_the_digest_is_of_the_bytes_up_to_the_last_wanted_frame(lerobot_root):
    one, other = (
        packets_digest(part(lerobot_root, RGB, [0.0, 0.1])),
        packets_digest(part(lerobot_root, RGB, [0.0, 0.4])),
    )
    assert one == packets_digest(part(lerobot_root, RGB, [0.0, 0.1]))
    assert one[0] != other[0]
    assert 0 < one[1] < other[1] < part(lerobot_root, RGB, [0]).path.stat().st_size


@pytest.mark.parametrize(
    ("times", "changes", "reason"),
    [
        ([0.1, 0.15, 0.2], {}, Reason.FRAME_MISSING),  # no frame is shown at 0.15 s
        ([0.1, 99.0], {}, Reason.FRAME_MISSING),
        ([0.0], {"max_pixels": 64}, Reason.FRAME_TOO_LARGE),
    ],
)
def test_what_is_not_there_or_too_large_is_refused(lerobot_root, times, changes, reason):
    with pytest.raises(DataError) as caught:
        list(decoded(part(lerobot_root, RGB, times, **changes), rgb_u8))
    assert caught.value.reason is reason


def test_colour_is_no_depth(lerobot_root):
    with pytest.raises(DataError, match="12 bits") as caught:
        list(decoded(part(lerobot_root, RGB, [0.0]), depth_codes))
    assert caught.value.reason is Reason.DEPTH_NOT_16_BIT


def test_a_video_with_any_bytes_changed_or_cut_is_decoded_or_refused(lerobot_root, tmp_path):
    whole = part(lerobot_root, RGB, [0.0, 0.3, 0.5])
    data = np.frombuffer(whole.path.read_bytes(), np.uint8)
    rng = np.random.default_rng(0)
    refused = 0
    for trial in range(60):
        changed = data.copy()
        changed[rng.integers(len(data), size=20)] = rng.integers(256, size=20)
        (tmp_path / "any.mp4").write_bytes(
            changed[: len(data) if trial % 2 else int(rng.integers(len(data)))].tobytes()
        )
        try:
            list(decoded(part(lerobot_root, RGB, [0.0, 0.3, 0.5], path=tmp_path / "any.mp4"), rgb_u8))
        except DataError:
            refused += 1
    assert refused >= 30  # every one that was cut
