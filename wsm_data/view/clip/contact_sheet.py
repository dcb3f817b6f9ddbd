"""One clip on one page: what its latents decode to, its map and path, and how the goal comes nearer."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator

from wsm_data.codecs.base import VideoCodec
from wsm_data.files.atomic import write_bytes
from wsm_data.schema.clip import Clip
from wsm_data.view.clip.facts import depth_valid_share, world_path_m
from wsm_data.view.clip.map_plot import PATH_COLOUR, draw_clip_map, draw_frame_marks, map_key
from wsm_data.view.clip.pictures import ClipPictures, decode_pictures, spread_frames
from wsm_data.view.drawing.depth_colours import draw_depth_bar
from wsm_data.view.drawing.style import BAR, GRID, MUTED, figure_png, figure_style, new_figure
from wsm_data.view.drawing.text_table import printable

_WIDTH_PX = 1600
_MARGIN_PX = 40
_COLUMNS = 6
_BANDS = 2  # of an RGB row over a depth row
_BAR_PX = 66
_LABEL_PX = 50
_GAP_PX = 8
_CAPTION_PX = 34
_HEADER_PX = 96
_LOWER_PX = 640
_MAP_PX = (670, 490)
_PLOT_LEFT_PX = 870


@dataclass(frozen=True, kw_only=True)
class _Band:
    """Place of a row of RGB pictures over a row of depth pictures, in pixels from the top of the sheet."""

    top_px: int
    picture_px: int
    row_px: int


def draw_contact_sheet(clip: Clip, codec: VideoCodec, path: Path) -> None:
    """Write the contact sheet of one clip as a PNG, 1600 px wide.

    Args:
        clip: what is shown.
        codec: the codec the clip was encoded with.
        path: where the PNG goes; replaced atomically.

    Raises:
        ConfigError: the clip was encoded with another codec.
    """
    pictures = decode_pictures(clip, codec, spread_frames(clip.meta.recorded_frames, _COLUMNS * _BANDS))
    with figure_style():
        write_bytes(path, figure_png(contact_sheet_figure(clip, pictures)))


def contact_sheet_figure(clip: Clip, pictures: ClipPictures) -> Figure:
    """Draw the contact sheet of a clip; call within `figure_style()`.

    Args:
        clip: what is shown.
        pictures: decoded frames of the clip.
    """
    columns_px = _WIDTH_PX - 2 * _MARGIN_PX - _LABEL_PX - _BAR_PX
    picture_px = columns_px // _COLUMNS - _GAP_PX
    row_px = round(picture_px * clip.intrinsics.height / clip.intrinsics.width)
    band_px = 2 * row_px + _GAP_PX + _CAPTION_PX
    bands = -(-len(pictures.frames) // _COLUMNS)
    figure = new_figure(_WIDTH_PX, _HEADER_PX + bands * band_px + _LOWER_PX)
    _draw_header(figure, clip)
    for number in range(bands):
        shown = range(number * _COLUMNS, len(pictures.frames))[:_COLUMNS]
        band = _Band(top_px=_HEADER_PX + number * band_px, picture_px=picture_px, row_px=row_px)
        _draw_band(figure, clip, pictures, shown, band)
    _draw_lower_part(figure, clip, pictures.frames, _HEADER_PX + bands * band_px)
    return figure


def _axes(figure: Figure, left_px: float, top_px: float, width_px: float, height_px: float) -> Axes:
    total_px = figure.get_figheight() * 100
    return figure.add_axes(
        (left_px / _WIDTH_PX, 1 - (top_px + height_px) / total_px, width_px / _WIDTH_PX, height_px / total_px)
    )


def _text(figure: Figure, left_px: float, top_px: float, text: str, **style: Any) -> Text:
    return figure.text(left_px / _WIDTH_PX, 1 - top_px / (figure.get_figheight() * 100), text, va="top", **style)


def _draw_header(figure: Figure, clip: Clip) -> None:
    meta = clip.meta
    facts = (
        meta.dataset,
        f"camera {meta.id.camera}, {meta.camera_height_m:.2f} m high, {np.rad2deg(meta.camera_pitch_rad):.1f}° down",
        f"codec {meta.codec} {meta.codec_digest[:12]}",
        f"{clip.meta.recorded_frames} frames + {meta.padded_frames} still = {clip.latent_count} latents",
        "no depth" if (measured := depth_valid_share(clip)) is None else f"depth measured {measured:.1%}",
        f"map from {meta.map_from}, {meta.map_resolution_m * 100:g} cm cells",
    )
    _fitted_text(figure, 24, meta.key, fontsize=17, fontweight="bold")
    _fitted_text(figure, 60, printable("   ·   ".join(facts)), fontsize=11, color=MUTED)


def _fitted_text(figure: Figure, top_px: float, text: str, **style: Any) -> None:
    """Write a line from margin to margin; where it is longer, its middle gives way."""
    artist = _text(figure, _MARGIN_PX, top_px, text, **style)
    renderer, characters = FigureCanvasAgg(figure).get_renderer(), len(text)
    while artist.get_window_extent(renderer).width > _WIDTH_PX - 2 * _MARGIN_PX:
        characters -= 1
        artist.set_text(elided(text, characters))


def percent(share: float) -> str:
    """A share in whole per cent: a caption must not run into the number of the next picture."""
    return f"{100 * share:.0f} %"


def elided(text: str, characters: int) -> str:
    """Text of at most so many characters, its middle replaced by an ellipsis where it is longer."""
    if len(text) <= characters:
        return text
    head = (characters - 1) // 2
    return f"{text[:head]}…{text[len(text) - (characters - 1 - head) :]}"


def _draw_band(figure: Figure, clip: Clip, pictures: ClipPictures, shown: Sequence[int], band: _Band) -> None:
    depth_top_px = band.top_px + band.row_px + _GAP_PX
    for name, row_top_px in (("RGB", band.top_px), ("depth", depth_top_px)):
        middle = 1 - (row_top_px + band.row_px / 2) / (figure.get_figheight() * 100)
        style: dict[str, Any] = {"rotation": 90, "va": "center", "ha": "center", "fontsize": 12, "fontweight": "bold"}
        figure.text((_MARGIN_PX + _LABEL_PX - 18) / _WIDTH_PX, middle, name, **style)
    for column, index in enumerate(shown):
        left_px = _MARGIN_PX + _LABEL_PX + column * (band.picture_px + _GAP_PX)
        for picture, row_top_px in ((pictures.rgb_u8[index], band.top_px), (pictures.depth_u8[index], depth_top_px)):
            axes = _axes(figure, left_px, row_top_px, band.picture_px, band.row_px)
            axes.imshow(picture, interpolation="antialiased", aspect="auto")
            axes.set_axis_off()
        caption_px = depth_top_px + band.row_px + 5
        _text(figure, left_px, caption_px, str(index + 1), fontsize=10, fontweight="bold", color=PATH_COLOUR)
        caption = f"frame {pictures.frames[index]}, {percent(pictures.depth_valid_share[index])} measured"
        _text(figure, left_px + 24, caption_px, caption, fontsize=10, color=MUTED)
    bar_left_px = _MARGIN_PX + _LABEL_PX + _COLUMNS * (band.picture_px + _GAP_PX) + 4
    draw_depth_bar(_axes(figure, bar_left_px, depth_top_px, 14, band.row_px), clip.meta.depth_range)


def _draw_lower_part(figure: Figure, clip: Clip, frames: Sequence[int], top_px: int) -> None:
    map_axes = _axes(figure, _MARGIN_PX + _LABEL_PX, top_px + 34, *_MAP_PX)
    map_axes.set_anchor("NW")
    draw_clip_map(map_axes, clip)
    map_axes.set_title("Map, geodesic distance to the goal region, expert's path")
    draw_frame_marks(map_axes, world_path_m(clip)[:, :2], frames)
    width_px = _WIDTH_PX - _MARGIN_PX - _PLOT_LEFT_PX
    distance_axes = _axes(figure, _PLOT_LEFT_PX, top_px + 34, width_px, 195)
    progress_axes = _axes(figure, _PLOT_LEFT_PX, top_px + 34 + _MAP_PX[1] - 195, width_px, 195)
    _draw_distance(distance_axes, clip, frames)
    _draw_progress(progress_axes, clip)
    figure.legend(
        handles=map_key(), loc="lower left", bbox_to_anchor=((_MARGIN_PX + _LABEL_PX - 8) / _WIDTH_PX, 0.004), ncols=7
    )


def _draw_distance(axes: Axes, clip: Clip, frames: Sequence[int]) -> None:
    axes.plot(np.arange(clip.frame_count), clip.expert_distance, color=BAR, lw=2)
    axes.plot(
        list(frames), clip.expert_distance[list(frames)], ls="", marker="o", ms=5, color=PATH_COLOUR, mec="white", mew=1
    )
    axes.set(title="Distance to the goal region (dots: the pictures above)", ylabel="geodesic distance (m)")
    axes.set_ylim(0, 1.06 * float(clip.expert_distance.max()) or 1.0)
    _finish_time_axes(axes, clip)


def _draw_progress(axes: Axes, clip: Clip) -> None:
    # Float64 before the difference: millimetres of a distance of metres.
    progress_mm = -np.diff(clip.expert_distance.astype(np.float64)) * 1000
    axes.axhline(0, color=MUTED, lw=0.8)
    axes.bar(np.arange(1, clip.frame_count), progress_mm, width=1.0, color=BAR, lw=0)
    axes.set(title="Progress of each step", ylabel="progress (mm)")
    _finish_time_axes(axes, clip)


def _finish_time_axes(axes: Axes, clip: Clip) -> None:
    last = clip.frame_count - 1
    if clip.meta.padded_frames:
        first_still = clip.meta.recorded_frames - 0.5
        axes.axvspan(first_still, last + 0.5, facecolor=GRID, alpha=0.6, lw=0, zorder=0)
        middle = (first_still + last + 0.5) / 2
        place: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "rotation": 90,
            "transform": axes.get_xaxis_transform(),
        }
        axes.text(middle, 0.5, "still (padding)", color=MUTED, fontsize=10, **place)
    axes.set(xlim=(-0.5, last + 0.5), xlabel="frame number (count)")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y")
