"""Trajectory errors and alignments against evo, on random paths.

Run by hand with evo (GPL, so no part of the project) beside it: `pip install --no-deps --target FOLDER evo`, then
`PYTHONPATH=FOLDER:bench python bench/by_hand/trajectory_metrics.py`. 200 random walks of 3 to 300 poses are turned,
scaled, moved and made noisy; errors are compared unaligned, after SE(3) and after Sim(3) alignment, and so are the
alignments, and the pairs that association makes of two sets of jittered stamps.
"""

import copy

import numpy as np
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from reporting import machine, machine_line, table, write_results
from scipy.spatial.transform import Rotation

from wsm_data.metrics.association import associate
from wsm_data.metrics.trajectory import ate_rmse_unaligned_m, ate_se3, ate_sim3

PATHS = 200
LIMIT = 1e-9
NAMES = ("unaligned", "SE(3)", "Sim(3)", "Sim(3) scale", "Sim(3) rotation", "Sim(3) translation")


def as_evo(centres: np.ndarray, stamps: np.ndarray) -> PoseTrajectory3D:
    return PoseTrajectory3D(centres.copy(), np.tile([1.0, 0, 0, 0], (len(centres), 1)), stamps)


def evo_rmse(estimated: PoseTrajectory3D, true: PoseTrajectory3D) -> float:
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((true, estimated))
    return float(error.get_statistic(metrics.StatisticsType.rmse))


def random_pair(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    true = np.cumsum(rng.normal(size=(int(rng.integers(3, 301)), 3)) * rng.uniform(0.01, 0.5), axis=0)
    moved = np.exp(rng.normal()) * true @ Rotation.random(random_state=rng).as_matrix().T + rng.normal(size=3)
    return moved + rng.normal(size=true.shape) * rng.uniform(0, 0.3), true


def differences(estimated: np.ndarray, true: np.ndarray) -> list[float]:
    stamps = np.arange(len(true)) * 0.1
    theirs_true, theirs = as_evo(true, stamps), as_evo(estimated, stamps)
    unaligned = abs(evo_rmse(theirs, theirs_true) - ate_rmse_unaligned_m(estimated, true))
    rigid, similar = copy.deepcopy(theirs), copy.deepcopy(theirs)
    rigid.align(theirs_true)
    rotation, translation, scale = similar.align(theirs_true, correct_scale=True)
    ours = ate_sim3(estimated, true)
    return [
        unaligned,
        abs(evo_rmse(rigid, theirs_true) - ate_se3(estimated, true).rmse_m),
        abs(evo_rmse(similar, theirs_true) - ours.rmse_m),
        abs(scale - ours.alignment.scale),
        float(np.abs(rotation - ours.alignment.rotation).max()),
        float(np.abs(translation - ours.alignment.translation_m).max()),
    ]


def same_pairs(rng: np.random.Generator) -> bool:
    """Whether association pairs the same stamps, of keyframes and frames with jitter."""
    frames = np.arange(200) / 30 + rng.uniform(-0.008, 0.008, 200)
    keyframes = np.sort(rng.choice(200, 40, replace=False)) / 30 + rng.uniform(-0.008, 0.008, 40)
    a, b = sync.associate_trajectories(
        as_evo(np.zeros((200, 3)), frames), as_evo(np.zeros((40, 3)), keyframes), max_diff=0.01
    )
    ours_a, ours_b = associate(frames, keyframes)
    return bool(np.array_equal(a.timestamps, frames[ours_a]) and np.array_equal(b.timestamps, keyframes[ours_b]))


def main() -> None:
    rng = np.random.default_rng(0)
    largest = np.array([differences(*random_pair(rng)) for _ in range(PATHS)]).max(axis=0)
    paired = sum(same_pairs(rng) for _ in range(PATHS))
    assert (largest < LIMIT).all(), dict(zip(NAMES, largest.tolist(), strict=True))
    assert paired == PATHS, paired
    host = machine("numpy", "evo")
    rows = [[name, f"{value:.1e}"] for name, value in zip(NAMES, largest, strict=True)]
    lines = [
        "# Trajectory errors against evo",
        "",
        f"Largest difference over {PATHS} random paths (m, or none), which must stay below {LIMIT:.0e}:",
        "",
        *table(["what", "largest difference"], rows),
        "",
        f"Association gave evo's pairs for {paired} of {PATHS} pairs of jittered stamps.",
        "",
        machine_line(host),
    ]
    record = {
        "machine": host,
        "paths": PATHS,
        "largest_difference": dict(zip(NAMES, largest.tolist(), strict=True)),
        "same_pairs": paired,
    }
    write_results("trajectory_metrics", record, lines)


if __name__ == "__main__":
    main()
