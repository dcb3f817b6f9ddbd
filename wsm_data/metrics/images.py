"""How alike two pictures are in structure: SSIM (Wang et al., 2004), with that paper's constants and window."""

import numpy as np
from scipy.ndimage import gaussian_filter

from wsm_data.schema.arrays import Float32Array, Float64Array

_SIGMA_PX, _RADIUS_PX = 1.5, 5
"""The Gaussian window of 11 x 11 pixels."""

_SPAN = 2.0  # of values in [-1, 1]
_LUMINANCE, _CONTRAST = (0.01 * _SPAN) ** 2, (0.03 * _SPAN) ** 2


def ssim(reference: Float32Array, other: Float32Array) -> float:
    """Mean structural similarity of two videos [T, H, W, 3] in [-1, 1]: 1 where they are equal.

    The mean over frames, colours and the pixels whose whole window lies in the picture, with population moments.

    Raises:
        ValueError: the shapes differ, there is no frame, or a side is shorter than the window.
    """
    window = 2 * _RADIUS_PX + 1
    if reference.shape != other.shape or not len(reference) or min(reference.shape[1:3]) < window:
        raise ValueError(
            f"both must be [T, H, W, 3] of one shape with T >= 1 and sides of at least {window} px, found "
            f"{reference.shape} and {other.shape}"
        )
    frames = zip(
        reference.astype(np.float64) + 1, other.astype(np.float64) + 1, strict=True
    )  # from 0 on, as it is defined
    return float(np.mean([_of_frame(a, b) for a, b in frames]))


def _of_frame(a: Float64Array, b: Float64Array) -> float:
    mean_a, mean_b = _windowed(a), _windowed(b)
    variances = _windowed(a * a) - mean_a**2 + _windowed(b * b) - mean_b**2
    covariance = _windowed(a * b) - mean_a * mean_b
    luminance = (2 * mean_a * mean_b + _LUMINANCE) / (mean_a**2 + mean_b**2 + _LUMINANCE)
    return float((luminance * (2 * covariance + _CONTRAST) / (variances + _CONTRAST)).mean())


def _windowed(values: Float64Array) -> Float64Array:
    """Gaussian means around the pixels whose whole window lies in the picture."""
    inside = slice(_RADIUS_PX, -_RADIUS_PX)
    blurred = gaussian_filter(values, sigma=(_SIGMA_PX, _SIGMA_PX, 0), radius=(_RADIUS_PX, _RADIUS_PX, 0))
    return np.asarray(blurred[inside, inside])
