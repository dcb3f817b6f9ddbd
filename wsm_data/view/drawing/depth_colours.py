"""Metric depth as a picture: one perceptually even colour map over the range the model sees, no measurement in grey."""

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from wsm_data.schema.arrays import BoolArray, Float32Array, Uint8Array
from wsm_data.schema.depth import DepthRange

INVALID_GREY = (158, 158, 158)
"""A grey is no colour of the map, so a hole never looks like a depth."""

# Viridis from yellow (near) to violet (far): its lightness falls evenly, so equal steps of depth look equal.
_TABLE = np.round(colormaps["viridis_r"](np.linspace(0.0, 1.0, 256))[:, :3] * 255).astype(np.uint8)


def depth_picture(depth_m: Float32Array, depth_range: DepthRange, valid: BoolArray | None = None) -> Uint8Array:
    """Colour a depth image, linear in metres over `depth_range` (the paper's figures: 0.2 to 5 m).

    Args:
        depth_m: depth along the optical axis, m, [..., H, W]; 0 and what is not finite is "no measurement".
        depth_range: ends of the colour map; what lies outside takes the colour of the nearer end.
        valid: where there was a measurement, bool [..., H, W]; None when `depth_m` says it itself.

    Returns:
        uint8 [..., H, W, 3].
    """
    measured = np.isfinite(depth_m) & (depth_m > 0)
    if valid is not None:
        measured &= valid
    share = (np.where(measured, depth_m, depth_range.min_m) - depth_range.min_m) / (
        depth_range.max_m - depth_range.min_m
    )
    picture = _TABLE[np.round(np.clip(share, 0.0, 1.0) * 255).astype(np.intp)]
    picture[~measured] = INVALID_GREY
    return picture


def draw_depth_bar(axes: Axes, depth_range: DepthRange) -> None:
    """Draw the key to `depth_picture` as a vertical bar, near at the bottom, labelled in metres."""
    axes.imshow(
        _TABLE[:, None, :], origin="lower", aspect="auto", extent=(0.0, 1.0, depth_range.min_m, depth_range.max_m)
    )
    whole = np.arange(np.ceil(depth_range.min_m), np.floor(depth_range.max_m) + 1)
    inner = whole[(whole - depth_range.min_m > 0.3) & (depth_range.max_m - whole > 0.3)]
    axes.set_yticks([depth_range.min_m, *inner, depth_range.max_m])
    axes.set_xticks([])
    axes.yaxis.tick_right()
    axes.yaxis.set_label_position("right")
    axes.set_ylabel("depth (m)")
    axes.spines[:].set_visible(False)


def depth_gradient(stops: int = 9) -> str:
    """The colour map as a CSS gradient, near at the left."""
    chosen = _TABLE[np.linspace(0, 255, stops).round().astype(np.intp)]
    colours = ", ".join(f"rgb({red} {green} {blue})" for red, green, blue in chosen.tolist())
    return f"linear-gradient(90deg, {colours})"
