"""Clips of a walled room and what is known of them, releases and selections of them, and a judge of figures."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wsm_data.access.release import Release
from wsm_data.files.json_values import to_json
from wsm_data.schema.clip import Clip

sys.path.insert(0, str(Path(__file__).parents[1] / "fakes"))

from surveyed_selection import selected, survey_of  # noqa: F401
from walled_release import (
    CAMERA_HEIGHT_M,
    CODEC,
    FRAMES,
    GOAL_CELL,
    HOSTILE_SCENE,
    ORIGIN_CELL,
    PADDED,
    QUALITY,
    REFUSALS,
    RESOLUTION_M,
    START_CELL,
    UNITS,
    build_clip,
    build_release,
)


def visible_axes(figure: Figure) -> Iterator[Axes]:
    """Axes that show an axis with ticks; a picture has none."""
    return (axes for axes in figure.axes if axes.axison)


def unlabelled_axes(figure: Figure) -> list[str]:
    """Axes with ticks whose label names no unit in brackets at its end."""
    found = []
    for axes in visible_axes(figure):
        for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
            text = axis.get_label_text()
            if len(axis.get_ticklocs()) and not (text.endswith(")") and "(" in text):
                found.append(f"{axes.get_title(loc='left')} {name}: {text!r}")
    return found


@pytest.fixture
def clip() -> Clip:
    return build_clip()


@pytest.fixture(scope="session")
def release(tmp_path_factory) -> Release:
    return build_release(tmp_path_factory.mktemp("view"), UNITS, codec_quality=to_json(QUALITY))


@pytest.fixture(scope="session")
def made() -> SimpleNamespace:
    """What the tests build things with, and the numbers they expect."""
    return SimpleNamespace(
        clip=build_clip,
        release=build_release,
        codec=CODEC,
        unlabelled_axes=unlabelled_axes,
        units=UNITS,
        refusals=REFUSALS,
        hostile_scene=HOSTILE_SCENE,
        frames=FRAMES,
        padded=PADDED,
        resolution_m=RESOLUTION_M,
        origin_cell=ORIGIN_CELL,
        start_cell=START_CELL,
        goal_cell=GOAL_CELL,
        camera_height_m=CAMERA_HEIGHT_M,
    )
