import numpy as np
import pytest

from wsm_data.metrics.images import ssim


def gaussian_window() -> np.ndarray:
    """11 x 11, deviation 1.5, of sum 1 (the paper's section III.B)."""
    line = np.exp(-(np.arange(-5, 6) ** 2) / (2 * 1.5**2))
    window = np.outer(line, line)
    return window / window.sum()


def slow_ssim(a: np.ndarray, b: np.ndarray) -> float:
    """Formula 13 of the paper, window by window; c1 and c2 of a span of 2."""
    window, found = gaussian_window(), []
    for colour in range(3):
        for y in range(a.shape[0] - 10):
            for x in range(a.shape[1] - 10):
                p, q = (1 + one[y : y + 11, x : x + 11, colour] for one in (a, b))
                mean_p, mean_q = (window * p).sum(), (window * q).sum()
                variance_p, variance_q = (window * (p - mean_p) ** 2).sum(), (window * (q - mean_q) ** 2).sum()
                covariance = (window * (p - mean_p) * (q - mean_q)).sum()
                c1, c2 = 0.02**2, 0.06**2
                found.append(
                    (2 * mean_p * mean_q + c1)
                    * (2 * covariance + c2)
                    / ((mean_p**2 + mean_q**2 + c1) * (variance_p + variance_q + c2))
                )
    return float(np.mean(found))


def test_it_is_the_formula_of_the_paper_window_by_window():
    a, b = np.random.default_rng(0).uniform(-1, 1, (2, 1, 14, 17, 3)).astype(np.float32)
    b = 0.5 * a + 0.5 * b
    assert ssim(a, b) == pytest.approx(slow_ssim(a[0].astype(float), b[0].astype(float)), rel=1e-9)


def test_equal_videos_have_one_and_a_negative_has_less_than_nothing():
    video = np.random.default_rng(0).uniform(-1, 1, (2, 16, 16, 3)).astype(np.float32)
    assert ssim(video, video) == pytest.approx(1.0, abs=1e-12)
    assert ssim(0.2 * video, -0.2 * video) < 0


@pytest.mark.parametrize("shape", [(0, 16, 16, 3), (1, 10, 16, 3), (1, 16, 17, 3)])
def test_what_has_no_frame_no_window_or_another_shape_is_refused(shape):
    reference = np.zeros((*shape[:2], 16, 3), np.float32)
    with pytest.raises(ValueError, match=r"one shape with T >= 1 and sides of at least 11 px"):
        ssim(reference, np.zeros(shape, np.float32))
