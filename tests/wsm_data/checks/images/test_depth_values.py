"""A slanted plane, of which 1 / depth is linear in the image, and what is done to it."""

import numpy as np
import pytest

from wsm_data.checks.images.depth_values import check_depth_values
from wsm_data.errors import Reason
from wsm_data.schema.source.check_limits import CheckLimits

UNIT_M = 1e-4
PLANE_M = (1 / np.linspace(0.2, 0.8, 320)[None] * np.linspace(1.0, 1.4, 240)[:, None]).astype(np.float32)
RNG = np.random.default_rng(0)


def stored(depth_m):
    return (np.rint(depth_m / UNIT_M) * UNIT_M).astype(np.float32)


def reasons(depth_m):
    verdicts = check_depth_values([stored(depth_m)] * 2, UNIT_M, CheckLimits(), "a/b/0")
    return [one.reason for one in verdicts.values() if one.reason]


def test_a_plane_is_kept_and_has_no_noise_but_its_rounding():
    """Rounding to 0.1 mm errs by 0.03 mm (0.1 / sqrt(12)), of 2 m on average: some 2e-5."""
    verdicts = check_depth_values([stored(PLANE_M)], UNIT_M, CheckLimits(), "a/b/0")
    assert all(one.keep for one in verdicts.values())
    assert verdicts["depth_noise"].measured["relative_depth_noise"] < 5e-5
    assert verdicts["depth_steps"].measured["depth_step_m"] == pytest.approx(UNIT_M)


@pytest.mark.parametrize("noise", [0.005, 0.01, 0.1])
def test_noise_is_measured_as_it_is(noise):
    noisy = stored(PLANE_M * (1 + noise * RNG.normal(size=PLANE_M.shape)))
    verdict = check_depth_values([noisy], UNIT_M, CheckLimits(), "a/b/0")["depth_noise"]
    assert verdict.measured["relative_depth_noise"] == pytest.approx(noise, rel=0.1)
    assert verdict.keep == (noise < 0.02)


def test_swapped_bytes_are_noise():
    codes = np.rint(PLANE_M / UNIT_M).astype(np.uint16).byteswap()
    assert Reason.DEPTH_NOISY in reasons(codes * UNIT_M)


def test_eight_bits_are_found_by_their_step_or_their_number():
    """Multiples of 256 codes are 2.56 cm; a curve of 256 values has no step."""
    assert reasons(np.rint(PLANE_M / 0.0256) * 0.0256) == [Reason.DEPTH_COARSE]
    curve = np.exp(np.rint(np.log(PLANE_M) * 100) / 100)
    assert reasons(curve) == [Reason.DEPTH_COARSE]


@pytest.mark.parametrize(("share", "kept"), [(0.5, True), (0.05, False)])
def test_depth_that_is_mostly_lost_is_found(share, kept):
    lost = np.where(RNG.random(PLANE_M.shape) < share, PLANE_M, 0)
    assert (Reason.DEPTH_SPARSE not in reasons(lost)) == kept


def test_no_images_tell_nothing():
    assert check_depth_values([], UNIT_M, CheckLimits(), "a/b/0") == {}
