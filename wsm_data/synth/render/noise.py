"""Random fields that repeat without a seam."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


def clouds(
    rng: np.random.Generator, size: int, roughness: float = 1.0, stretch: tuple[float, float] = (1.0, 1.0)
) -> Float64Array:
    """Noise of power-law spectrum in [0, 1], periodic, [size, size]; row is v.

    Args:
        rng: source of randomness.
        size: side in texels.
        roughness: 0 is white noise, 1 and more are clouds.
        stretch: how much longer the features are along u and along v than they would be.
    """
    v, u = np.meshgrid(
        np.fft.fftfreq(size) * size * stretch[1], np.fft.rfftfreq(size) * size * stretch[0], indexing="ij"
    )
    amplitude = 1.0 / np.maximum(np.hypot(u, v), 1.0) ** roughness
    amplitude[0, 0] = 0.0
    field = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((size, size))) * amplitude, s=(size, size))
    return normalised(field)


def normalised(field: Float64Array) -> Float64Array:
    """The field with its 1 % and 99 % quantiles at 0 and 1, clipped."""
    low, high = np.quantile(field, [0.01, 0.99])
    return np.clip((field - low) / max(high - low, 1e-12), 0.0, 1.0)


def coordinates(size: int) -> tuple[Float64Array, Float64Array]:
    """Coordinates u and v of the texel centres in [0, 1), both [size, size]; u runs along rows."""
    steps = (np.arange(size) + 0.5) / size
    return np.broadcast_to(steps[None, :], (size, size)), np.broadcast_to(steps[:, None], (size, size))


def mix(low: tuple[float, float, float], high: tuple[float, float, float], weight: Float64Array) -> Float64Array:
    """Colours between two, by a weight [...] in [0, 1]; [..., 3]."""
    a, b = np.array(low), np.array(high)
    return a + (b - a) * weight[..., None]


def smooth_step(value: Float64Array, start: float, end: float) -> Float64Array:
    """0 before `start`, 1 after `end`, and a smooth way between."""
    x = np.clip((value - start) / (end - start), 0.0, 1.0)
    return x * x * (3 - 2 * x)
