"""The report of a release: one HTML file that needs nothing else, on a phone, in print, in light and dark."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from wsm_data.access.release import Release
from wsm_data.codecs.quality import CodecQuality
from wsm_data.curation.audit.finding import Check
from wsm_data.files.atomic import write_bytes
from wsm_data.files.json_values import from_json
from wsm_data.shards.manifest import release_digest
from wsm_data.view.clip.facts import ClipFacts
from wsm_data.view.clip.map_figures import clip_map_figure, scene_map_figure
from wsm_data.view.clip.map_plot import MAP_SWATCHES, SCENE_SWATCHES
from wsm_data.view.drawing.depth_colours import depth_gradient
from wsm_data.view.drawing.page import data_url, inline_svg, page_template
from wsm_data.view.drawing.style import figure_style
from wsm_data.view.release.charts import depth_error_chart, histogram, stage_chart
from wsm_data.view.release.clip_survey import ClipSurvey, ClipThumbnail
from wsm_data.view.release.counts import ReleaseCounts, count_release
from wsm_data.view.release.distributions import Distribution, clip_distributions
from wsm_data.view.release.drop_examples import drop_examples
from wsm_data.view.release.report_data import ReportData

_TEMPLATE = "report.html.j2"


@dataclass(frozen=True, kw_only=True)
class _Card:
    """A clip as the template shows it; the pictures are data URLs, in the order of time."""

    key: str
    split: str
    dataset: str
    facts: ClipFacts
    frames: tuple[int, ...]
    rgb: tuple[str, ...]
    depth: tuple[str, ...]
    measured: tuple[float, ...]
    map_svg: Markup


@dataclass(frozen=True, kw_only=True)
class _AuditRow:
    """What one check of the audit found; the example is a worst one."""

    check: str
    found: int
    worst: str
    example: str


@dataclass(frozen=True, kw_only=True)
class _Figure:
    """A chart with its caption; `note` says what was left out."""

    title: str
    note: str
    svg: Markup


def write_report(data: ReportData, release: Release, path: Path) -> None:
    """Write the report of a release.

    Equal releases and data give equal bytes, timings in `data.stages` included.

    Args:
        data: what is not in the release's own files.
        release: the release.
        path: where the HTML file goes; replaced atomically.
    """
    write_bytes(path, report_html(data, release).encode("utf-8", "backslashreplace"))


def report_html(data: ReportData, release: Release) -> str:
    """Return the report as one HTML page. Whatever comes from a source is escaped."""
    counts = count_release(release)
    stated = release.manifest.codec_quality
    quality = from_json(CodecQuality, stated) if stated else None
    with figure_style():
        return page_template(_TEMPLATE).render(
            manifest=release.manifest,
            digest=release_digest(release.manifest),
            counts=counts,
            drops=drop_examples(release),
            survey=data.survey,
            noted=_noted(data.survey),
            distributions=[
                _distribution(number, one) for number, one in enumerate(_distributions(data.survey, counts))
            ],
            quality=quality,
            quality_svg=_quality_svg(quality) if quality else None,
            depth_gradient=depth_gradient(),
            map_swatches=MAP_SWATCHES,
            scene_swatches=SCENE_SWATCHES,
            scenes=_scenes(data.survey),
            cards=[_card(number, one, data.survey) for number, one in enumerate(data.survey.thumbnails)],
            audit=_audit(data),
            stages=data.stages,
            planned=data.planned,
            stage_svg=_stage_svg(data) if data.stages else None,
        )


def _audit(data: ReportData) -> list[_AuditRow] | None:
    """Checks with what they found; None where nobody looked."""
    if data.audit is None:
        return None
    of_check = {check: [one for one in data.audit if one.check is check] for check in Check}
    return [
        _AuditRow(
            check=check.value,
            found=len(found),
            worst=found[0].severity.value if found else "",
            example=found[0].message if found else "",
        )
        for check, found in of_check.items()
    ]


def _distributions(survey: ClipSurvey, counts: ReleaseCounts) -> list[Distribution]:
    frames = tuple(float(number) for number in counts.frames_per_clip)
    every = Distribution(title="Frames", label="frames of a clip, padding left out (count)", finest=1.0, values=frames)
    return [every, *clip_distributions(survey.facts)]


def _distribution(number: int, shown: Distribution) -> _Figure:
    note = f"{shown.missing:,} clips have no such number." if shown.missing else ""
    if not shown.values:
        return _Figure(title=shown.title, note="No clip that was read has such a number.", svg=Markup())
    svg = inline_svg(histogram(shown), f"distribution-{number}", f"Distribution: {shown.title}")
    return _Figure(title=shown.title, note=note, svg=svg)


def _quality_svg(quality: CodecQuality) -> Markup:
    return inline_svg(depth_error_chart(quality.depth), "depth-error", "Mean absolute depth error over true depth")


def _stage_svg(data: ReportData) -> Markup:
    return inline_svg(stage_chart(data.stages), "stages", "Seconds on the wall that each stage took")


def _scenes(survey: ClipSurvey) -> list[_Figure]:
    return [
        _Figure(
            title=scene.scene,
            note=_paths(len(scene.paths)),
            svg=inline_svg(
                scene_map_figure(scene), f"scene-{number}", f"Map of {scene.scene} with {_paths(len(scene.paths))}"
            ),
        )
        for number, scene in enumerate(survey.scenes)
    ]


def _paths(count: int) -> str:
    return "1 path" if count == 1 else f"{count} paths"


def _card(number: int, shown: ClipThumbnail, survey: ClipSurvey) -> _Card:
    clip, pictures = shown.clip, shown.pictures
    return _Card(
        key=clip.meta.key,
        split=shown.split,
        dataset=clip.meta.dataset,
        facts=next(facts for facts in survey.facts if facts.key == clip.meta.key),
        frames=pictures.frames,
        rgb=tuple(data_url(picture) for picture in pictures.rgb_u8),
        depth=tuple(data_url(picture) for picture in pictures.depth_u8),
        measured=tuple(pictures.depth_valid_share.tolist()),
        map_svg=inline_svg(clip_map_figure(clip), f"map-{number}", f"Map and path of {clip.meta.key}"),
    )


def _noted(survey: ClipSurvey) -> dict[str, int]:
    return dict(sorted(Counter(note for facts in survey.facts for note in facts.notes).items()))
