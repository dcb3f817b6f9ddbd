"""An estimated way of a camera beside the true one, seen from above."""

from collections.abc import Mapping
from pathlib import Path

from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import Float64Array
from wsm_data.view.clip.map_plot import PATH_COLOUR, TRAIN_COLOUR
from wsm_data.view.drawing.style import MUTED, figure_png, figure_style, new_figure

_SIZE_PX = (720, 640)
_LOOKS: Mapping[str, tuple[str, str]] = {
    "true": (PATH_COLOUR, "-"),
    "estimated, aligned": (TRAIN_COLOUR, "-"),
    "estimated, as it is": (MUTED, "--"),
}


def draw_estimated_paths(path: Path, title: str, centres_m: Mapping[str, Float64Array]) -> None:
    """Write a PNG of camera centres in the first camera's frame, x to the right and z up; replaced atomically.

    Args:
        path: where the PNG goes.
        title: stands above.
        centres_m: float64 [T, 3] in m under some of the names `true`, `estimated, aligned` and `estimated, as it is`.
    """
    with figure_style():
        figure = new_figure(*_SIZE_PX)
        axes = figure.add_subplot()
        for name, centres in centres_m.items():
            colour, line = _LOOKS[name]
            axes.plot(centres[:, 0], centres[:, 2], color=colour, ls=line, lw=1.8, label=name)
            axes.plot(*centres[0, [0, 2]], marker="o", ms=5, color=colour, mec="white")
        axes.set(title=title, xlabel="first camera's x, to the right (m)", ylabel="first camera's z, forward (m)")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid()
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=len(centres_m))
        figure.tight_layout()
        write_bytes(path, figure_png(figure))
