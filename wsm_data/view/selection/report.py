"""The report of a selection: one HTML file that says what was chosen, and why."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from markupsafe import Markup

from wsm_data.access.release import Release
from wsm_data.codecs.base import VideoCodec
from wsm_data.curation.explain import score_label, value_text
from wsm_data.curation.survey import ScoreSurvey, SelectionSurvey, SelectionSurveyConfig, SurveyedClip, survey_selection
from wsm_data.files.atomic import write_bytes
from wsm_data.schema.arrays import Float64Array
from wsm_data.view.clip.map_figures import clip_map_figure
from wsm_data.view.clip.map_plot import MAP_SWATCHES
from wsm_data.view.clip.pictures import decode_pictures, spread_frames
from wsm_data.view.drawing.depth_colours import depth_gradient
from wsm_data.view.drawing.page import data_url, inline_svg, page_template
from wsm_data.view.drawing.style import figure_style
from wsm_data.view.selection.charts import compared_histogram, difficulty_chart, leading_chart

_TEMPLATE = "selection.html.j2"
_SHOWN_PLACES = 12
_PICTURES = 6


@dataclass(frozen=True, kw_only=True)
class _ScoreRow:
    """A score as the template shows it."""

    label: str
    summary: str
    direction: str
    weight: float
    leads: int
    median: str
    chosen_median: str
    svg: Markup


@dataclass(frozen=True, kw_only=True)
class _Card:
    """A clip as the template shows it; the pictures are data URLs, in the order of time."""

    key: str
    rank: int | None
    difficulty: float
    why: str
    frames: tuple[int, ...]
    rgb: tuple[str, ...]
    depth: tuple[str, ...]
    map_svg: Markup


def write_selection_report(
    release: Release,
    name: str,
    scores_location: str,
    codec: VideoCodec,
    path: Path,
    shown: SelectionSurveyConfig | None = None,
) -> None:
    """Write the report of a selection; equal inputs give equal bytes.

    Args:
        release: the release.
        name: name of the selection, or path of its file.
        scores_location: the scores it was made from.
        codec: the codec of the release.
        path: where the HTML file goes; replaced atomically.
        shown: how much is shown.

    Raises:
        ConfigError: selection or scores are of another release.
        IntegrityError: a clip that is shown is damaged.
    """
    survey = survey_selection(release, name, scores_location, shown)
    write_bytes(path, selection_html(release, survey, codec).encode("utf-8", "backslashreplace"))


def selection_html(release: Release, survey: SelectionSurvey, codec: VideoCodec) -> str:
    """Return the report as one HTML page. Whatever comes from a source is escaped.

    Raises:
        ConfigError: the codec is not the release's.
        IntegrityError: a clip that is shown is damaged.
    """
    ruling = [one for one in survey.scores if one.weight]
    card = partial(_card, release, codec)
    with figure_style():
        return page_template(_TEMPLATE).render(
            manifest=release.manifest,
            selection=survey.selection,
            counts=survey.selection.rule["clips"],
            config=survey.config,
            scores=[_score(number, one) for number, one in enumerate(survey.scores) if len(one.values)],
            difficulty_svg=inline_svg(
                difficulty_chart(survey.difficulty, survey.selection.scores), "difficulty", "Distribution of difficulty"
            ),
            leading_svg=inline_svg(
                leading_chart([score_label(one.info) for one in ruling], [one.leads for one in ruling]),
                "leading",
                "Chosen clips by the score that made them hard",
            ),
            places={kind: places[:_SHOWN_PLACES] for kind, places in survey.places.items()},
            hidden_places={kind: len(places[_SHOWN_PLACES:]) for kind, places in survey.places.items()},
            others=survey.others,
            bootstrap=survey.bootstrap,
            bootstrap_range=_range(survey.bootstrap.jaccard),
            hardest=[card(f"hard-{number}", one) for number, one in enumerate(survey.hardest)],
            borderline=[card(f"border-{number}", one) for number, one in enumerate(survey.borderline)],
            listed=survey.listed,
            map_swatches=MAP_SWATCHES,
            depth_gradient=depth_gradient(),
        )


def _score(number: int, one: ScoreSurvey) -> _ScoreRow:
    label = score_label(one.info)
    unit = {"share": "share of the clip", "ratio": "ratio"}.get(one.info.unit, one.info.unit)
    figure = compared_histogram(one.values, one.chosen, f"{label} ({unit})", one.info.unit == "share")
    return _ScoreRow(
        label=label,
        summary=one.info.summary,
        direction=one.info.direction.value,
        weight=one.weight,
        leads=one.leads,
        median=_median(one.values, one.info.unit),
        chosen_median=_median(one.chosen, one.info.unit),
        svg=inline_svg(figure, f"score-{number}", f"Distribution of {label} over all clips and over the chosen ones"),
    )


def _median(values: Float64Array, unit: str) -> str:
    return value_text(float(np.median(values)), unit) if len(values) else "none has one"


def _range(overlaps: tuple[float, ...]) -> tuple[float, float, float] | None:
    """Median, least and largest overlap."""
    return (float(np.median(overlaps)), min(overlaps), max(overlaps)) if overlaps else None


def _card(release: Release, codec: VideoCodec, name: str, shown: SurveyedClip) -> _Card:
    clip = release.read_clip(shown.key)
    pictures = decode_pictures(clip, codec, spread_frames(clip.meta.recorded_frames, _PICTURES))
    return _Card(
        key=shown.key,
        rank=shown.rank,
        difficulty=shown.difficulty,
        why=shown.why,
        frames=pictures.frames,
        rgb=tuple(data_url(picture) for picture in pictures.rgb_u8),
        depth=tuple(data_url(picture) for picture in pictures.depth_u8),
        map_svg=inline_svg(clip_map_figure(clip), name, f"Map and path of {shown.key}"),
    )
