import json
import math

import numpy as np
import pytest

from wsm_data.codecs.quality import CodecQuality, DepthErrors, clip_quality, depth_error_by_range, psnr_db
from wsm_data.files.json_values import from_json, to_json

EDGES_M = (0.2, 1.0, 5.0)


def test_psnr_of_a_known_error():
    reference = np.zeros((1, 2, 2, 3), np.float32)
    # An error of 0.02 everywhere in a range of 2: 20 log10(100) = 40 dB.
    assert psnr_db(reference, reference + np.float32(0.02)) == pytest.approx(40, abs=1e-5)


def test_psnr_of_8_bit_images_is_the_usual_one():
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 256, (2, 3, 8, 8, 3))
    usual = 10 * math.log10(255**2 / np.mean((a - b) ** 2))
    assert psnr_db((a / 127.5 - 1).astype(np.float32), (b / 127.5 - 1).astype(np.float32)) == pytest.approx(usual)


def test_psnr_of_equal_videos_is_infinite(noise_video):
    assert psnr_db(noise_video, noise_video) == math.inf


def test_videos_of_other_shapes_are_refused(noise_video):
    with pytest.raises(ValueError, match="shape"):
        psnr_db(noise_video, noise_video[:-1])


def test_depth_errors_fall_into_the_range_of_the_true_depth():
    reference = np.array([0.1, 0.2, 0.9, 1.0, 5.0, 5.1, 3.0])
    decoded = np.array([9.0, 0.3, 0.8, 1.5, 4.5, 9.0, 9.0])
    valid = np.array([True, True, True, True, True, True, False])
    errors = depth_error_by_range(reference, decoded, valid, EDGES_M)
    assert errors.counts == (2, 2)
    np.testing.assert_allclose(errors.mean_error_m, (0.1, 0.5))
    assert errors.shares == (2 / 7, 2 / 7)


def test_depth_clipped_to_the_outer_borders_is_counted():
    edges_m = (0.7, 1.0, 4.3)  # in float32, 0.7 is below and 4.3 above these numbers
    reference = np.array(edges_m, np.float32)
    errors = depth_error_by_range(reference, reference, np.ones(3, bool), edges_m)
    assert errors.counts == (1, 2)


def test_an_empty_range_has_no_mean():
    errors = depth_error_by_range(np.array([0.5]), np.array([0.5]), np.array([True]), EDGES_M)
    assert errors.mean_error_m == (0.0, None)


def test_merged_parts_equal_the_whole():
    rng = np.random.default_rng(1)
    reference, decoded = rng.uniform(0.1, 6, (2, 8, 4, 4)).astype(np.float32)
    valid = rng.random((8, 4, 4)) < 0.8
    colours, degraded = rng.uniform(-1, 1, (2, 8, 4, 4, 3)).astype(np.float32)

    def measured(part):
        depth = depth_error_by_range(reference[part], decoded[part], valid[part], EDGES_M)
        return clip_quality(colours[part], degraded[part], depth)

    whole, merged = measured(slice(0, 8)), measured(slice(0, 3)).merge(measured(slice(3, 8)))
    assert merged.clips == 2
    assert merged.depth.counts == whole.depth.counts
    assert merged.depth.pixels == whole.depth.pixels == 128
    assert merged.psnr_db == pytest.approx(whole.psnr_db, rel=1e-12)
    assert merged.psnr_db == pytest.approx(psnr_db(colours, degraded), rel=1e-12)
    np.testing.assert_allclose(merged.depth.error_sum_m, whole.depth.error_sum_m, rtol=1e-12)


def test_other_ranges_cannot_be_merged():
    a, b = (DepthErrors(edges_m=(0.0, end), error_sum_m=(0.0,), counts=(0,), pixels=0) for end in (1.0, 2.0))
    with pytest.raises(ValueError, match="equal ranges"):
        a.merge(b)


def test_json_gives_the_same_value_back():
    depth = depth_error_by_range(np.array([0.3, 2.0]), np.array([0.4, 2.1]), np.array([True, True]), EDGES_M)
    quality = CodecQuality(clips=1, squared_error_sum=0.1 + 0.2, values=12, depth=depth)
    assert from_json(CodecQuality, json.loads(json.dumps(to_json(quality)))) == quality


@pytest.mark.parametrize("edges_m", [(1.0,), (1.0, 1.0), (2.0, 1.0)])
def test_ranges_that_do_not_increase_are_refused(edges_m):
    with pytest.raises(ValueError, match="increas"):
        DepthErrors(edges_m=edges_m, error_sum_m=(), counts=(), pixels=0)


def test_no_values_have_no_psnr():
    depth = DepthErrors(edges_m=EDGES_M, error_sum_m=(0.0, 0.0), counts=(0, 0), pixels=0)
    with pytest.raises(ValueError, match="at least one value"):
        _ = CodecQuality(clips=0, squared_error_sum=0.0, values=0, depth=depth).psnr_db
