import numpy as np
import pytest

from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import normalise_depth, valid_share
from wsm_data.curation.scorers.depth_quality import invalid_share, saturated_share
from wsm_data.schema.depth import DepthRange


def test_invalid_is_what_is_not_measured(make_images):
    valid = np.full((4, 2, 3), 255, np.uint8)
    valid[0, 0] = 0
    assert invalid_share(make_images(depth_valid=valid)) == pytest.approx(3 / 24)
    assert invalid_share(make_images()) == 0.0


def sampled(make_images, depth_m, measured):
    """Images whose one sampled frame shows this depth, through the codec and back; [32, 64]."""
    shown = np.where(measured, depth_m, 0.0)
    video = np.repeat(normalise_depth(shown, DepthRange())[None, ..., None], 3, axis=-1)
    codec = DctCodec()
    frame = codec.decode(codec.encode(video))[0].mean(axis=-1)
    latents = np.zeros((1, 48, 2, 4), np.float16)
    valid = valid_share(measured[None])
    return make_images(
        rgb_latent=latents,
        depth_valid=valid,
        sampled=np.zeros(1, np.int64),
        sampled_depth=frame[None].astype(np.float32),
    )


def test_saturated_is_what_lies_at_a_limit_and_is_measured(make_images):
    depth_m, measured = np.full((32, 64), 2.0), np.ones((32, 64), bool)
    depth_m[:16, :16] = 7.0  # one cell of eight beyond the far limit
    depth_m[16:, 16:32] = 0.1  # one nearer than the near limit
    measured[:16, 48:] = False  # one without a measurement
    assert saturated_share(sampled(make_images, depth_m, measured)) == pytest.approx(2 / 8)
    measured[:] = False
    assert saturated_share(sampled(make_images, depth_m, measured)) == 0.0


def test_more_saturated_pixels_are_harder(make_images):
    found = []
    for far in range(0, 65, 16):
        depth_m = np.full((32, 64), 2.0)
        depth_m[:, :far] = 9.0
        found.append(saturated_share(sampled(make_images, depth_m, np.ones((32, 64), bool))))
    assert found == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])


def test_where_no_depth_was_decoded_there_is_no_score(make_images):
    assert saturated_share(make_images()) is None
