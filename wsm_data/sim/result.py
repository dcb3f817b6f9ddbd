"""What an episode leaves behind."""

from dataclasses import dataclass

from wsm_data.planners.planner import Plan
from wsm_data.schema.arrays import Float64Array
from wsm_data.sim.episodes import Episode
from wsm_data.sim.rules import Ending


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A plan, and when it was asked for.

    Attributes:
        step: the control step of the observation.
        pose: where the robot truly was then, world; float64 [3].
        plan: the answer.
    """

    step: int
    pose: Float64Array
    plan: Plan


@dataclass(frozen=True, kw_only=True)
class Rollout:
    """What happened in one episode of S control steps.

    Attributes:
        scene: name of the world.
        number: of the episode in its list.
        episode: start and goal.
        ending: why it ended.
        success: whether it counts as a success by the protocol.
        poses: true x, y, heading in the world; float64 [S + 1, 3].
        commands: speed and turning rate; float64 [S, 2].
        clearance_m: distance of the centre to the nearest obstacle at each pose, m, up to where worlds look; [S + 1].
        contact: whether the motion of a step was ended by an obstacle; bool [S].
        driven_m: sum of the signed forward speed over time, m.
        geodesic_m: shortest way of the footprint from start to goal, m.
        answers: all plans in order.
    """

    scene: str
    number: int
    episode: Episode
    ending: Ending
    success: bool
    poses: Float64Array
    commands: Float64Array
    clearance_m: Float64Array
    contact: Float64Array
    driven_m: float
    geodesic_m: float
    answers: tuple[Answer, ...]


@dataclass(frozen=True, kw_only=True)
class EpisodeResult:
    """One row of the table of episodes.

    Attributes:
        scene: name of the world.
        episode: number in its list.
        planner: name of the planner.
        ending: why it ended.
        success: by the protocol.
        spl_geodesic: success weighted by path length, of the geodesic distance.
        spl_straight: the same, of the straight distance, as the public code has it.
        straight_m: straight distance at the start, m.
        geodesic_m: geodesic distance at the start, m.
        driven_m: length that was driven, m.
        seconds: simulated time, s.
        navigation_error_m: final distance to the goal, m.
        localisation_error_m: distance of the planner's last own goal from the true one; None where it gives none.
        ate_rmse_unaligned_m: error of the planner's own poses; None where it gives none.
        collisions: how often it touched something.
        near_misses: how often something came near to it without being touched.
        plans: how many answers were used.
    """

    scene: str
    episode: int
    planner: str
    ending: Ending
    success: bool
    spl_geodesic: float
    spl_straight: float
    straight_m: float
    geodesic_m: float
    driven_m: float
    seconds: float
    navigation_error_m: float
    localisation_error_m: float | None
    ate_rmse_unaligned_m: float | None
    collisions: int
    near_misses: int
    plans: int
