"""Guards that need the labels of clips: paths that two splits share, and labels of one place that disagree."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence

import numba
import numpy as np
from scipy.spatial import cKDTree

from wsm_data.curation.audit.clip_labels import ClipLabels
from wsm_data.curation.audit.finding import AuditFinding, Check, Severity
from wsm_data.curation.diversity import SAME_FLOOR_M, discrete_frechet_m, paths_are_near
from wsm_data.curation.split import TRAIN
from wsm_data.schema.arrays import Float32Array

SAME_PATH_M = 0.1
"""Paths that stay this close are one path driven twice: two cells of a map, as far as starts that count as the same."""

_SHOWN_CLIPS = 5


def near_duplicates_across_splits(labels: Sequence[ClipLabels], within_m: float) -> Iterator[AuditFinding]:
    """Held-out clips whose path runs beside one that is trained on, in one physical scene and on one floor.

    It is an error where the two are one path (`SAME_PATH_M`), or where the same physical scene was filmed by another
    camera, and otherwise a warning. Each clip is named once, with the training clip that is worst, or else nearest.

    Args:
        labels: all clips.
        within_m: largest discrete Frechet distance of the paths, m.
    """
    for clips in _groups(labels, lambda one: one.row.physical_scene):
        trained = defaultdict(list)
        for one in clips:
            if one.row.split == TRAIN:
                trained[one.row.camera].append(one)
        outlines = {camera: np.array([one.outline_xy_m for one in of], np.float32) for camera, of in trained.items()}
        for one in clips:
            if one.row.split == TRAIN:
                continue
            found = []
            for camera, others in outlines.items():
                nearest, distance_m = _nearest(one.outline_xy_m.astype(np.float32), others, within_m)
                if nearest >= 0:
                    found.append((distance_m, _near(one, trained[camera][nearest], distance_m)))
            if found:
                yield min(found, key=lambda pair: (-pair[1].severity.rank, pair[0]))[1]


def distance_conflicts(labels: Sequence[ClipLabels], same_place_m: float, tolerance_m: float) -> Iterator[AuditFinding]:
    """Clips with the same start and goal whose expert distances differ.

    The distance is that of the shortest way on the map, so it depends on the map and on the robot's radius alone. It is
    an error where both are the same robot's, a warning where the robots differ in radius or camera.

    Args:
        labels: all clips.
        same_place_m: starts, and goals, that are no farther apart along each axis are the same, m.
        tolerance_m: distances may differ by this beside what start and goal differ, m.
    """
    for clips in _groups(labels, lambda one: one.row.physical_scene):
        ends = np.array([np.concatenate([one.start_m, one.goal_m]) for one in clips])
        pairs = cKDTree(ends).query_pairs(same_place_m, p=np.inf, output_type="ndarray")
        for first, second in sorted(pairs.tolist()):
            moved_m = float(np.linalg.norm((ends[first] - ends[second]).reshape(2, 3), axis=1).sum())
            a, b = clips[first], clips[second]
            if abs(a.expert_distance_m - b.expert_distance_m) > tolerance_m + moved_m:
                yield _conflict(a, b)


def map_conflicts(labels: Sequence[ClipLabels]) -> Iterator[AuditFinding]:
    """Scenes of one group whose clips on one floor were labelled on different maps."""
    for clips in _groups(labels, lambda one: f"{one.row.group}/{one.row.scene}"):
        digests = defaultdict(list)
        for one in clips:
            digests[one.map_digest].append(one.row.key)
        if len(digests) > 1:
            counts = ", ".join(f"{len(keys)} on {digest[:12]}" for digest, keys in sorted(digests.items()))
            yield AuditFinding(
                check=Check.MAP_CONFLICT,
                severity=Severity.WARNING,
                clips=tuple(sorted(key for keys in digests.values() for key in sorted(keys)[:_SHOWN_CLIPS])),
                message=(
                    f"clips of {clips[0].row.group}/{clips[0].row.scene} on the floor at {clips[0].start_m[2]:.2f} m "
                    f"were labelled on {len(digests)} maps: {counts}"
                ),
            )


def _groups(labels: Sequence[ClipLabels], scene_of: Callable[[ClipLabels], str]) -> Iterator[list[ClipLabels]]:
    """Clips of one scene and one floor, sorted by key."""
    scenes: dict[str, list[ClipLabels]] = defaultdict(list)
    for one in labels:
        scenes[scene_of(one)].append(one)
    for _, clips in sorted(scenes.items()):
        clips.sort(key=lambda one: float(one.start_m[2]))
        heights_m = np.array([one.start_m[2] for one in clips])
        for floor in np.split(np.arange(len(clips)), np.flatnonzero(np.diff(heights_m) > SAME_FLOOR_M) + 1):
            yield sorted((clips[number] for number in floor), key=lambda one: one.row.key)


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _nearest(path: Float32Array, others: Float32Array, within_m: float) -> tuple[int, float]:
    """Number of the nearest of the paths that are near, and its distance, m; -1 where none is."""
    found, least_m = -1, np.inf
    for number in range(len(others)):
        if paths_are_near(path, others[number], within_m):
            distance_m = discrete_frechet_m(path, others[number])
            if distance_m < least_m:
                found, least_m = number, distance_m
    return found, least_m


def _near(held_out: ClipLabels, trained: ClipLabels, distance_m: float) -> AuditFinding:
    across = held_out.row.camera != trained.row.camera
    cameras = f"{held_out.row.camera} and {trained.row.camera}"
    seen_by = f"across cameras {cameras}" if across else f"camera {trained.row.camera}"
    return AuditFinding(
        check=Check.PATH_IN_SPLITS,
        severity=Severity.ERROR if across or distance_m <= SAME_PATH_M else Severity.WARNING,
        clips=(held_out.row.key, trained.row.key),
        message=(
            f"the path of the first, in {held_out.row.split}, runs within {distance_m:.2f} m of that of the second, in "
            f"{trained.row.split} ({seen_by})"
        ),
    )


def _conflict(a: ClipLabels, b: ClipLabels) -> AuditFinding:
    robots = [(one.row.camera, one.robot_radius_m) for one in (a, b)]
    same = robots[0] == robots[1]
    robot = (
        "for the same robot" if same else " and ".join(f"{camera} of radius {radius:g} m" for camera, radius in robots)
    )
    return AuditFinding(
        check=Check.DISTANCE_CONFLICT,
        severity=Severity.ERROR if same else Severity.WARNING,
        clips=(a.row.key, b.row.key),
        message=(
            f"the same start and goal are {a.expert_distance_m:.2f} m apart in the first, and "
            f"{b.expert_distance_m:.2f} m in the second, {robot}"
        ),
    )
