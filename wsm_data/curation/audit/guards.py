"""Guards of a release: what leaks between its splits, what it holds twice, and which labels contradict one another."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from wsm_data.access.release import Release
from wsm_data.curation.audit.clip_labels import read_labels
from wsm_data.curation.audit.content import CONTENT_COLUMNS, repeated_content, scenes_in_several_splits
from wsm_data.curation.audit.finding import AuditFinding, Check, worst_first
from wsm_data.curation.audit.labels import distance_conflicts, map_conflicts, near_duplicates_across_splits
from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.split import SplitBy


@dataclass(frozen=True, kw_only=True)
class AuditConfig:
    """What an audit holds a release to.

    Attributes:
        split_by: what was dealt as a whole when the splits were made.
        near: when two paths count as one.
        same_place_m: starts, or goals, no farther apart than this along each axis are the same, m; two map cells.
        distance_tolerance_m: by how much expert distances of the same start and goal may differ, m; the distance field
            is exact to half a per cent, on ways of tens of metres.
    """

    split_by: SplitBy = SplitBy.TRAJECTORY
    near: DiversityConfig = field(default_factory=DiversityConfig)
    same_place_m: float = 0.1
    distance_tolerance_m: float = 0.25


def audit_release(
    release: Release, config: AuditConfig | None = None, on_clip: Callable[[], object] | None = None
) -> list[AuditFinding]:
    """Look for leaks, repetitions and contradictions. Latents are not read.

    Args:
        release: the release.
        config: what it is held to.
        on_clip: called after each clip that was read.

    Returns:
        Findings, worst first; equal releases give equal findings.

    Raises:
        IntegrityError: a clip is damaged.
    """
    config = config or AuditConfig()
    index = release.index.columns(CONTENT_COLUMNS)
    labels = []
    for shard in release.manifest.shards:
        for row in release.index.rows_of_shard(shard.name):
            labels.append(read_labels(release, row))
            if on_clip:
                on_clip()
    return worst_first(
        [
            *scenes_in_several_splits(index, config.split_by),
            *repeated_content(index),
            *near_duplicates_across_splits(labels, config.near.within_m),
            *distance_conflicts(labels, config.same_place_m, config.distance_tolerance_m),
            *map_conflicts(labels),
        ]
    )


def count_findings(findings: Sequence[AuditFinding]) -> dict[Check, int]:
    """How often each check found something, all checks in their order."""
    counts = Counter(one.check for one in findings)
    return {check: counts[check] for check in Check}
