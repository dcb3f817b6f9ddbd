"""All checks that need nothing but the record, in the order in which they are told."""

from collections.abc import Callable, Mapping

from wsm_data.checks.gate import joined_verdict
from wsm_data.checks.intrinsics_fit import check_intrinsics_fit
from wsm_data.checks.length import check_length
from wsm_data.checks.mount import check_mount
from wsm_data.checks.pose_jump import check_pose_jump
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Refusal, Verdict

RECORD_CHECKS: Mapping[str, Callable[[EpisodeRecord, DatasetManifest], Verdict]] = {
    "length": lambda record, dataset: check_length(record, dataset.min_frames),
    "intrinsics_fit": lambda record, dataset: check_intrinsics_fit(record, dataset.cameras, dataset.checks),
    "mount": check_mount,
    "pose_jump": lambda record, dataset: check_pose_jump(record, dataset.checks),
}


def check_record(record: EpisodeRecord, dataset: DatasetManifest) -> dict[str, Verdict]:
    """Verdicts of all record checks by name, in the order of RECORD_CHECKS; a failed one does not stop the others."""
    return {name: check(record, dataset) for name, check in RECORD_CHECKS.items()}


def record_refusal(record: EpisodeRecord, dataset: DatasetManifest) -> Refusal | None:
    """The reasons not to keep a record, written down under the first; None where every check keeps it."""
    verdict = joined_verdict(list(check_record(record, dataset).values()))
    if verdict.reason is None:
        return None
    return Refusal(
        unit=record.id.text,
        source=record.container,
        reason=verdict.reason,
        message=verdict.message,
        details=verdict.measured,
    )
