"""What a model makes of a clip, beside the truth: dreamed RGB, estimated depth, estimated path."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array, require_array
from wsm_data.schema.depth import DepthRange
from wsm_data.view.drawing.depth_colours import depth_picture, draw_depth_bar
from wsm_data.view.drawing.style import BAR, BAR_SECOND, MUTED, figure_png, figure_style, new_figure

_PICTURE_PX = 240
_LABEL_PX = 150
_BAR_PX = 90
_GAP_PX = 6
_TOP_PX = 70
_PATH_PX = 420


@dataclass(frozen=True, kw_only=True)
class DreamSheet:
    """N frames of one clip, seen and dreamed.

    Attributes:
        title: what is shown.
        frames: numbers of the raw frames.
        true_rgb_u8: what the clip's latents decode to; uint8 [N, H, W, 3].
        dreamed_rgb_u8: what the dreamed latents decode to; uint8 [N, H, W, 3].
        true_depth_m: of the clip's depth latents, m; float32 [N, H, W]. None, and no row, where it was not read.
        estimated_depth_m: of the estimated latents, m; float32 [N, H, W]. None, and no row, where none is estimated.
        depth_range: ends of the depth colours.
        true_path_m: camera centres in the first camera's frame, m; float64 [T, 3].
        estimated_path_m: as estimated from observed frames; float64 [T, 3].
        dreamed_path_m: as read from the dream; float64 [S, 3].
    """

    title: str
    frames: tuple[int, ...]
    true_rgb_u8: Uint8Array
    dreamed_rgb_u8: Uint8Array
    true_depth_m: Float32Array | None
    estimated_depth_m: Float32Array | None
    depth_range: DepthRange
    true_path_m: Float64Array
    estimated_path_m: Float64Array
    dreamed_path_m: Float64Array

    def __post_init__(self) -> None:
        shape = (len(self.frames), *self.true_rgb_u8.shape[1:3])
        for name in ("true_rgb_u8", "dreamed_rgb_u8"):
            require_array(name, getattr(self, name), np.uint8, (*shape, 3))
        for name in ("true_depth_m", "estimated_depth_m"):
            if getattr(self, name) is not None:
                require_array(name, getattr(self, name), np.float32, shape)


def draw_dream_sheet(sheet: DreamSheet, path: Path) -> None:
    """Write a sheet as a PNG; replaced atomically."""
    with figure_style():
        write_bytes(path, figure_png(dream_sheet_figure(sheet)))


def dream_sheet_figure(sheet: DreamSheet) -> Figure:
    """Draw a sheet; call within `figure_style()`."""
    count = len(sheet.frames)
    height, width = sheet.true_rgb_u8.shape[1:3]
    row_px = round(_PICTURE_PX * height / width)
    width_px = _LABEL_PX + count * (_PICTURE_PX + _GAP_PX) + _BAR_PX
    height_px = _TOP_PX + 4 * (row_px + _GAP_PX) + _PATH_PX
    figure = new_figure(width_px, height_px)
    figure.text(16 / width_px, 1 - 14 / height_px, sheet.title, va="top", fontsize=15, fontweight="bold")
    rows = [("RGB, true", sheet.true_rgb_u8), ("RGB, dreamed", sheet.dreamed_rgb_u8)]
    for name, depth_m in (("depth, true", sheet.true_depth_m), ("depth, estimated", sheet.estimated_depth_m)):
        if depth_m is not None:
            rows.append((name, depth_picture(depth_m, sheet.depth_range)))
    for row, (name, pictures) in enumerate(rows):
        top_px = _TOP_PX + row * (row_px + _GAP_PX)
        figure.text(16 / width_px, 1 - (top_px + row_px / 2) / height_px, name, va="center")
        for column, picture in enumerate(pictures):
            left_px = _LABEL_PX + column * (_PICTURE_PX + _GAP_PX)
            axes = figure.add_axes(_place(left_px, top_px, _PICTURE_PX, row_px, width_px, height_px))
            axes.imshow(picture, interpolation="antialiased", aspect="auto")
            axes.set_axis_off()
            if row == 0:
                caption = f"frame {sheet.frames[column]}"
                figure.text(left_px / width_px, 1 - (_TOP_PX - 20) / height_px, caption, color=MUTED, fontsize=10)
    bar_left_px = _LABEL_PX + count * (_PICTURE_PX + _GAP_PX) + 6
    bar_top_px = _TOP_PX + 2 * (row_px + _GAP_PX)
    draw_depth_bar(
        figure.add_axes(_place(bar_left_px, bar_top_px, 14, 2 * row_px + _GAP_PX, width_px, height_px)),
        sheet.depth_range,
    )
    _draw_path(figure, sheet, _TOP_PX + 4 * (row_px + _GAP_PX), width_px, height_px)
    return figure


def _draw_path(figure: Figure, sheet: DreamSheet, top_px: int, width_px: int, height_px: int) -> None:
    axes = figure.add_axes(
        _place(_LABEL_PX, top_px + 46, width_px - 2 * _LABEL_PX, _PATH_PX - 110, width_px, height_px)
    )
    paths = (
        ("true", sheet.true_path_m, MUTED, "-"),
        ("estimated from what was seen", sheet.estimated_path_m, BAR, "-"),
        ("read from the dream", sheet.dreamed_path_m, BAR_SECOND, "--"),
    )
    for name, points, colour, style in paths:
        axes.plot(points[:, 2], -points[:, 0], color=colour, ls=style, lw=2, label=name)
        axes.plot(points[-1:, 2], -points[-1:, 0], color=colour, marker="o", ms=5)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(
        title="Path from above, in the first camera's frame",
        xlabel="forward (m)",
        ylabel="left (m)",
    )
    axes.grid()
    axes.legend(loc="best")


def _place(
    left_px: float, top_px: float, of_width_px: float, of_height_px: float, width_px: int, height_px: int
) -> tuple[float, float, float, float]:
    return (
        left_px / width_px,
        1 - (top_px + of_height_px) / height_px,
        of_width_px / width_px,
        of_height_px / height_px,
    )
