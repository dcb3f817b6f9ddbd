"""Do the depth images of a trajectory fit its poses? Looked at in a few pairs of frames, at their stored size."""

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, pairwise

import numpy as np

from wsm_data.checks.depth_agreement import check_depth_agreement
from wsm_data.codecs.depth import depth_m_from_raw
from wsm_data.codecs.images import depth_codes
from wsm_data.errors import DataError
from wsm_data.geometry.transform import invert, rotation_angle_rad
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint16Array
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import DepthFrame, EpisodeFrames
from wsm_data.schema.verdict import Verdict

_LOG = logging.getLogger(__name__)

SPACING_M = 0.5
"""Way between the frames of a pair: wrong axes show, and most of the view is shared."""

TURN_M_PER_RAD = 1.0
"""A turn counts as way too: 29 degrees are a pair's spacing, and leave about half of the view shared."""

MAX_PAIRS = 7

STEP_M = 0.3
"""Way between the frames of a chain of pairs: most points of one are seen from the other."""

MAX_STEPS = 24
MAX_STEP_FRAMES = 30

_ROUNDING_M = 1e-6
"""Steps of 0.1 m add up to their multiples, but for this."""


@dataclass(frozen=True, kw_only=True)
class DepthSamples:
    """A few depth images of a trajectory.

    Attributes:
        pairs: frames that are compared, chosen by the way between them.
        steps: frames that are compared, chosen by time; each but the first begins where one before it ends.
        depth_m: by frame, depth along the optical axis, m, 0 without measurement; float32 [H, W].
        raw_u16: by frame, what it was made of: codes as stored; uint16 [H, W].
    """

    pairs: tuple[tuple[int, int], ...]
    steps: tuple[tuple[int, int], ...] = ()
    depth_m: Mapping[int, Float32Array]
    raw_u16: Mapping[int, Uint16Array] = field(default_factory=dict)


def sample_depth(record: EpisodeRecord, frames: EpisodeFrames, dataset: DatasetManifest) -> DepthSamples:
    """Decode the depth images that the checks look at.

    Raises:
        DataError: one of them does not decode.
    """
    measured = {number: image for number, image in enumerate(frames.depth) if image is not None}
    pairs = tuple(spread_pairs(record, sorted(measured)))
    steps = tuple(chained_steps(record, sorted(measured)))
    wanted = sorted({*chain(*pairs, *steps)})
    raw = {number: depth_codes(measured[number], f"{record.id.text}, depth frame {number}") for number in wanted}
    depth_m = {number: depth_m_from_raw(codes, dataset.depth) for number, codes in raw.items()}
    return DepthSamples(pairs=pairs, steps=steps, depth_m=depth_m, raw_u16=raw)


def check_samples(record: EpisodeRecord, samples: DepthSamples, dataset: DatasetManifest) -> Verdict:
    """Whether depth images contradict the poses (`pose.depth_disagree`), naming what would fit."""
    pairs = sorted({*samples.pairs, *samples.steps})
    return check_depth_agreement(record, samples.depth_m, pairs, dataset.camera_axes, dataset.checks.max_depth_error)


def agreeing_records(
    records: Sequence[EpisodeRecord],
    depth_samples: Mapping[str, Sequence[tuple[int, DepthFrame]]],
    dataset: DatasetManifest,
) -> list[EpisodeRecord]:
    """The trajectories whose depth samples do not contradict their poses.

    One that does would spoil the map that is fused for all of them; it is refused when it is encoded. Samples that do
    not decode are not looked at here.

    Args:
        records: trajectories of a scene.
        depth_samples: (frame number, depth image) by trajectory.
        dataset: conventions of the source.
    """
    kept = []
    for record in records:
        verdict = _samples_verdict(record, dict(depth_samples.get(record.id.text, ())), dataset)
        if verdict.keep:
            kept.append(record)
        else:
            _LOG.warning("left out of the map of its scene: %s", verdict.message)
    return kept


def _samples_verdict(record: EpisodeRecord, samples: Mapping[int, DepthFrame], dataset: DatasetManifest) -> Verdict:
    pairs = spread_pairs(record, sorted(samples))
    depth_m: dict[int, Float32Array] = {}
    for number in sorted({*chain(*pairs)}):
        try:
            depth_m[number] = _depth_m(record, number, samples[number], dataset)
        except DataError:
            continue
    whole = tuple((a, b) for a, b in pairs if a in depth_m and b in depth_m)
    return check_samples(record, DepthSamples(pairs=whole, depth_m=depth_m), dataset)


def spread_pairs(record: EpisodeRecord, numbers: Sequence[int]) -> list[tuple[int, int]]:
    """At most `MAX_PAIRS` pairs of frames, `SPACING_M` apart along the way, spread evenly from its start to its end.

    Of the frames given, those are taken between which the wanted piece of the way just lies.

    Way is path and turning together, `TURN_M_PER_RAD`. Where it is shorter than all pairs, there are fewer.

    Args:
        record: the trajectory.
        numbers: frames to choose from, ascending.
    """
    if len(numbers) < 2:
        return []
    way_m = _way_m(record)[np.asarray(numbers)]
    length_m = way_m[-1] - way_m[0]
    count = min(MAX_PAIRS, max(1, int(length_m / SPACING_M)))
    starts_m = way_m[0] + np.linspace(0, max(0.0, length_m - SPACING_M), count)
    first = np.searchsorted(way_m, starts_m + _ROUNDING_M, side="right") - 1
    second = np.searchsorted(way_m, starts_m + SPACING_M - _ROUNDING_M)
    pairs = {
        (numbers[a], numbers[min(b, len(numbers) - 1)]) for a, b in zip(first.tolist(), second.tolist(), strict=True)
    }
    return sorted((a, b) for a, b in pairs if a != b)


def chained_steps(record: EpisodeRecord, numbers: Sequence[int]) -> list[tuple[int, int]]:
    """Pairs of frames that follow one another from the first to the last, `STEP_M` apart at the mean speed.

    Chosen by time and not by the poses' own motion, they see where poses stand still while images move. At most
    `MAX_STEPS`, and no longer than `MAX_STEP_FRAMES` or half of the trajectory where that is enough.
    """
    if len(numbers) < 2:
        return []
    count = numbers[-1] - numbers[0]
    speed_m = float(_way_m(record)[-1]) / record.frame_count
    frames = min(MAX_STEP_FRAMES, STEP_M / speed_m if speed_m > 0 else math.inf, max(1, count // 2))
    steps = min(MAX_STEPS, len(numbers) - 1, max(1, round(count / frames)))
    chosen = np.rint(np.linspace(0, len(numbers) - 1, steps + 1)).astype(int).tolist()
    return [(numbers[a], numbers[b]) for a, b in pairwise(chosen)]


def _way_m(record: EpisodeRecord) -> Float64Array:
    """Way from the first frame to every frame, m; float64 [T]."""
    poses = record.T_world_camera
    steps_m = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    turns_rad = rotation_angle_rad((invert(poses[:-1]) @ poses[1:])[:, :3, :3])
    way_m: Float64Array = np.concatenate([[0.0], np.cumsum(steps_m + TURN_M_PER_RAD * turns_rad)])
    return way_m


def _depth_m(record: EpisodeRecord, number: int, image: DepthFrame, dataset: DatasetManifest) -> Float32Array:
    return depth_m_from_raw(depth_codes(image, f"{record.id.text}, depth frame {number}"), dataset.depth)
