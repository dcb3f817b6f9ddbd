"""`wsm report`: one HTML file that shows what is in a release."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.artifacts.plan_file import PLAN_NAME, Estimate, read_plan
from pipelines.registry import STAGES
from pipelines.running.folder import read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.running.stage import DONE, REFUSED, Outcome, Stage, StageContext, Unit
from pipelines.running.upstream import pending_units
from wsm_data.access.release import open_release, read_manifest
from wsm_data.curation.audit.finding import Severity
from wsm_data.curation.audit.guards import AuditConfig, audit_release
from wsm_data.curation.split import SplitBy
from wsm_data.files.digest import digest_json, sha256_file
from wsm_data.files.folder_bytes import folder_bytes
from wsm_data.files.stores import open_store
from wsm_data.files.typed_toml import INPUT
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.release_codec import codec_of
from wsm_data.view.release.clip_survey import SurveyConfig, survey_clips
from wsm_data.view.release.report import write_report
from wsm_data.view.release.report_data import Planned, ReportData, StageSummary, covered_seconds

REPORT_FILE = "report.html"
_S_PER_H = 3600.0


@dataclass(frozen=True, kw_only=True)
class ReportConfig:
    """Settings of `wsm report`.

    Attributes:
        release: folder or URL of the release.
        run: run folder whose stages are shown; where it is not given, the one the release lies in, if it does.
        weights: local folder of the codec's weights, where the codec has any.
        survey: how many clips are read, and how many are shown.
        audit: whether the release is audited as `wsm audit` does, which reads the labels of every clip.
        split_by: what was dealt as a whole when the splits were made; a recipe gives that of `split`.
    """

    release: str = field(metadata=INPUT)
    run: str = field(default="", metadata=INPUT)
    weights: str = field(default="", metadata=INPUT)
    survey: SurveyConfig = field(default_factory=SurveyConfig)
    audit: bool = True
    split_by: SplitBy = SplitBy.TRAJECTORY


def _list_units(config: ReportConfig) -> Sequence[Unit]:
    digest = release_digest(read_manifest(open_store(config.release)))
    return [Unit(id="report", inputs={"manifest": digest, "stages": _stages_digest(_run_folder(config))})]


def _process(batch: Sequence[Unit], config: ReportConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        release = open_release(config.release)
        survey = survey_clips(release, codec_of(release.manifest, config.weights), config.survey)
        audit = tuple(audit_release(release, AuditConfig(split_by=config.split_by))) if config.audit else None
        path = context.out / REPORT_FILE
        run = _run_folder(config)
        stages = stage_summaries(run)
        planned = planned_and_actual(run, Path(config.release), stages)
        data = ReportData(survey=survey, stages=stages, audit=audit, planned=planned)
        write_report(data, release, path)
        facts = {"bytes": path.stat().st_size, "clips shown": len(survey.thumbnails)}
        facts |= {"audit errors": sum(one.severity is Severity.ERROR for one in audit)} if audit is not None else {}
        yield Outcome(unit=unit.id, digest=sha256_file(path), outputs=(REPORT_FILE,), facts=facts)


def stage_summaries(run: Path) -> tuple[StageSummary, ...]:
    """What each stage of a run did, in the order of the flow; empty where the folder holds no run."""
    summaries = []
    for entry in STAGES:
        record = read_stage_record(run / entry.name)
        if record is None or not record.finished:
            continue
        settled = read_ledger(run / entry.name).values()
        outcomes = [one.outcome for one in settled]
        summaries.append(
            StageSummary(
                name=record.name,
                version=record.version,
                units=record.units,
                done=sum(outcome.state == DONE for outcome in outcomes),
                refused=sum(outcome.state == REFUSED for outcome in outcomes),
                pending=len(pending_units(run / entry.name)),
                seconds=sum(outcome.seconds for outcome in outcomes),
                wall_seconds=covered_seconds((one.time - one.outcome.seconds, one.time) for one in settled),
                workers=record.workers,
                fingerprint=record.fingerprint,
            )
        )
    return tuple(summaries)


def planned_and_actual(run: Path, release: Path, stages: Sequence[StageSummary]) -> tuple[Planned, ...]:
    """What `wsm plan` said of a run, and what came of it; empty where no plan was made for it.

    Time of stages that have not come to their end is not known. The disk is looked at as it is: what was reclaimed or
    cleaned by then does not count.
    """
    plan = read_plan(run)
    if plan is None:
        return ()
    took = {one.name: one.wall_seconds for one in stages}
    rows = [
        _planned(f"{name}, s", hours, took.get(name), _S_PER_H)
        for name, hours in _in_order(plan.stage_hours)
        if name != STAGE.name
    ]
    mib = 1 / (1 << 20)
    folders = [run / one.name for one in stages]
    return (
        *rows,
        _planned("release, MiB", plan.bytes_out, folder_bytes(release) * mib if release.is_dir() else None, mib),
        _planned("run folder, MiB", plan.peak_disk_bytes, sum(map(folder_bytes, folders)) * mib, mib),
    )


def _in_order(hours: Mapping[str, Estimate]) -> Iterator[tuple[str, Estimate]]:
    return ((one.name, hours[one.name]) for one in STAGES if one.name in hours)


def _planned(name: str, one: Estimate, actual: float | None, unit: float) -> Planned:
    return Planned(name=name, value=one.value * unit, low=one.low * unit, high=one.high * unit, actual=actual)


def _plan_digest(run: Path) -> str:
    path = run / PLAN_NAME
    return sha256_file(path) if path.is_file() else ""


def _stages_digest(run: Path) -> str:
    """What the stages of a run came to, without the report's own."""
    records = [read_stage_record(run / entry.name) for entry in STAGES if entry.name != STAGE.name]
    known = [[one.name, one.fingerprint, one.finished] for one in records if one is not None]
    plan = _plan_digest(run)
    return digest_json([*known, plan] if plan else known)


def _run_folder(config: ReportConfig) -> Path:
    return Path(config.run) if config.run else Path(config.release).parent.parent


STAGE = Stage(name="report", version=2, config_type=ReportConfig, list_units=_list_units, process=_process)
