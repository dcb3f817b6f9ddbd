"""The tracking controller against its problem as the benchmark poses it: casadi's expressions, solved by IPOPT.

Random smooth paths, and poses beside them, are given to both from a zero initial guess; and episodes of 20 control
steps, in which each starts from its last solution. Reported: how often the executed commands agree, whose minimum is
lower where they do not, and the time of one command.
"""

import time

import casadi as ca
import numpy as np
from reporting import machine, machine_line, table, write_results

from wsm_data.sim.base import drive_arc
from wsm_data.sim.tracking.controller import TrackingController
from wsm_data.sim.tracking.reference_path import reference_points
from wsm_data.sim.tracking.tracking_cost import STEPS, cost, drive

CASES, EPISODES, EPISODE_STEPS = 400, 20, 20
STEP_S, SPEED = 0.1, 0.5
SAME = 1e-3


def ipopt_solver() -> ca.Function:
    controls, states = ca.MX.sym("u", STEPS, 2), ca.MX.sym("x", STEPS + 1, 3)
    start, references = ca.MX.sym("p", 3), ca.MX.sym("r", 5, 2)
    objective, equal = 0, [states[0, :].T - start]
    for i in range(STEPS):
        objective += 0.02 * controls[i, 0] ** 2 + 0.15 * controls[i, 1] ** 2
        if i % 3 == 0 and i < 15:
            objective += 10 * ca.sumsqr(states[i, :2] - references[i // 3, :])
        heading = states[i, 2]
        moved = ca.vertcat(controls[i, 0] * ca.cos(heading), controls[i, 0] * ca.sin(heading), controls[i, 1])
        equal.append(states[i + 1, :].T - states[i, :].T - STEP_S * moved)
    problem = {
        "x": ca.vertcat(ca.vec(controls), ca.vec(states)),
        "f": objective,
        "g": ca.vertcat(*equal),
        "p": ca.vertcat(start, ca.vec(references)),
    }
    options = {
        "max_iter": 100,
        "print_level": 0,
        "acceptable_tol": 1e-8,
        "acceptable_obj_change_tol": 1e-6,
        "sb": "yes",
    }
    return ca.nlpsol("tracking", "ipopt", problem, {"ipopt": options, "print_time": 0})


class Ipopt:
    """The benchmark's controller for one path."""

    def __init__(self, solver: ca.Function, path: np.ndarray):
        self.solver, self.path = solver, path
        self.guess = np.zeros(2 * STEPS + 3 * (STEPS + 1))

    def command(self, pose: np.ndarray) -> tuple[float, float]:
        free = np.full(3 * (STEPS + 1), np.inf)
        speeds = np.full(STEPS, SPEED)
        references = reference_points(self.path, pose[:2])[:5]
        found = self.solver(
            x0=self.guess,
            lbx=np.concatenate([0 * speeds, -speeds, -free]),
            ubx=np.concatenate([speeds, speeds, free]),
            lbg=0,
            ubg=0,
            p=np.concatenate([pose, references.T.ravel()]),
        )
        self.guess = np.asarray(found["x"]).ravel()
        return float(self.guess[1]), float(self.guess[STEPS + 1])


def random_case(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A path of 24 points that bends smoothly, anywhere in a home, and a pose near its first points."""
    turns = np.cumsum(rng.normal(size=24) * rng.uniform(0, 0.3)) + rng.uniform(-np.pi, np.pi)
    steps = np.column_stack([np.cos(turns), np.sin(turns)]) * rng.uniform(0.03, 0.25)
    path = np.cumsum(steps, axis=0) + rng.uniform(-5, 5, 2)
    heading = turns[0] + rng.uniform(-1.5, 1.5)
    return path, np.array([*(path[0] + rng.normal(size=2) * 0.2), heading])


def total(controls: np.ndarray, pose: np.ndarray, path: np.ndarray) -> float:
    states = np.empty((STEPS + 1, 4))
    drive(controls, pose, states)
    return float(cost(controls, states, reference_points(path, pose[:2])[:5]))


def compare_once(solver: ca.Function, rng: np.random.Generator) -> tuple[bool, float]:
    """Whether the commands agree, and our minimum less theirs."""
    path, pose = random_case(rng)
    ours, theirs = TrackingController(path, SPEED), Ipopt(solver, path)
    same = np.allclose(ours.command(pose), theirs.command(pose), atol=SAME)
    return same, total(ours._controls, pose, path) - total(theirs.guess[: 2 * STEPS], pose, path)


def compare_episode(solver: ca.Function, rng: np.random.Generator) -> float:
    """Largest distance between two robots that start alike and follow one path, each by its own controller."""
    path, pose = random_case(rng)
    ours, theirs = TrackingController(path, SPEED), Ipopt(solver, path)
    one, other, apart = pose, pose, 0.0
    for _ in range(EPISODE_STEPS):
        one, other = drive_arc(one, *ours.command(one), 0.15), drive_arc(other, *theirs.command(other), 0.15)
        apart = max(apart, float(np.linalg.norm(one[:2] - other[:2])))
    return apart


def milliseconds(controller: TrackingController | Ipopt, pose: np.ndarray) -> float:
    start = time.perf_counter()
    for _ in range(50):
        controller.command(pose)
    return (time.perf_counter() - start) / 50 * 1e3


def main() -> None:
    solver, rng = ipopt_solver(), np.random.default_rng(0)
    cases = [compare_once(solver, rng) for _ in range(CASES)]
    same = sum(agree for agree, _ in cases)
    others = [difference for agree, difference in cases if not agree]
    apart = np.array([compare_episode(solver, rng) for _ in range(EPISODES)])
    path, pose = random_case(rng)
    times = [
        (milliseconds(TrackingController(path, SPEED), pose), milliseconds(Ipopt(solver, path), pose)) for _ in "12345"
    ]
    ours_ms, theirs_ms = np.median(times, axis=0)
    host = machine("casadi", "numba", "numpy")
    record = {
        "machine": host,
        "cases": CASES,
        "same_command": same,
        "ours_lower": sum(difference < -1e-6 for difference in others),
        "theirs_lower": sum(difference > 1e-6 for difference in others),
        "episodes_apart_m": {"median": float(np.median(apart)), "largest": float(apart.max())},
        "ours_ms": float(ours_ms),
        "ipopt_ms": float(theirs_ms),
    }
    rows = [
        ["same command within 1e-3, zero initial guess", f"{same} of {CASES}"],
        ["another local minimum: ours lower, theirs lower", f"{record['ours_lower']}, {record['theirs_lower']}"],
        [
            f"two robots after up to {EPISODE_STEPS} steps, median and largest distance",
            f"{np.median(apart):.1e} m, {apart.max():.1e} m",
        ],
        ["one command, ours", f"{ours_ms:.2f} ms"],
        ["one command, casadi and IPOPT", f"{theirs_ms:.1f} ms"],
    ]
    lines = ["# Tracking controller", "", *table(["what", "found"], rows), "", machine_line(host)]
    write_results("controller", record, lines)


if __name__ == "__main__":
    main()
