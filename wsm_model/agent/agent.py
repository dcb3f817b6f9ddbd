"""The agent: sees RGB and nothing else, keeps its own map and pose in the model's cache, dreams, and drives the dream.

One planning step: four new frames become a latent; the latent is observed and the states of the current chunk are
estimated again; a chunk is dreamed on to the goal, and its poses are read. What was dreamed is forgotten at once: the
history holds what was seen alone.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch

from wsm_data.files.digest import xxh3_64
from wsm_data.geometry.transform import invert, transform_points, transforms_from_vectors
from wsm_data.planners.planner import GoalFrame, Observation, Plan, Sense
from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_model.agent.config import AgentConfig
from wsm_model.agent.eye import Eye, Video
from wsm_model.agent.floor import floor_points, floor_pose, followed_path, goal_camera0_m, path_in_base
from wsm_model.config import Variant
from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Dream, Episode, Session, StateEstimate
from wsm_model.model import WorldSlamModel

Watcher = Callable[[int, Observation, Uint8Array], None]
"""Is shown each dream: environment, the observation that it began from, and its pictures, uint8 [T, H, W, 3]."""


@dataclass(kw_only=True)
class _Drive:
    """One environment.

    Attributes:
        video: its frames.
        episode: what the model knows of it.
        noise_key: from which, with the seed, the noise of its dreams follows.
        seen_step: control step of its last frame.
        goal_m: in the first camera's frame, from the first frame on; float64 [3].
        T_camera0_camera: the camera at the last frame of the newest latent, as it is estimated; float64 [4, 4].
        issued: the poses that were answered last; what a model without SLAM takes for those of the next latent.
    """

    video: Video = field(default_factory=Video)
    episode: Episode
    noise_key: bytes = b""
    seen_step: int | None = None
    goal_m: Float64Array = field(default_factory=lambda: np.zeros(3))
    T_camera0_camera: Float64Array = field(default_factory=lambda: np.eye(4))
    issued: StateEstimate | None = None


class Agent:
    """Implements `Planner`. Between two latents it answers None: the path that is being followed stands.

    What it answers in an environment depends on the seed and on what it saw there, and, but for rounding, not on how
    many environments are planned for together.

    Args:
        model: in evaluation mode, on the device that is used.
        eye: of the model's codec.
        config: settings.
        watcher: is shown the dreams; None where nobody looks. It may be changed between episodes.
    """

    name = "agent"
    senses = frozenset({Sense.RGB})

    def __init__(self, model: WorldSlamModel, eye: Eye, config: AgentConfig, watcher: Watcher | None = None):
        self._session = Session(model, config.session)
        self._eye, self._config, self.watcher = eye, config, watcher
        self._schedule = flow_schedule(config.flow_steps, config.flow_shift)
        self._device = next(model.parameters()).device
        self._camera: Intrinsics | None = None
        self._drives: list[_Drive] = []

    def reset(self, intrinsics: Intrinsics, environments: int) -> None:
        """Forget everything; the model knows no intrinsics, so only the size of the pictures is kept of them."""
        self._camera = intrinsics
        self._drives = [self._new_drive() for _ in range(environments)]

    def reset_environment(self, environment: int) -> None:
        """Forget one environment."""
        self._drives[environment] = self._new_drive()

    def plan(self, observations: Mapping[int, Observation]) -> Mapping[int, Plan | None]:
        """Take a frame of each environment, and plan for those in which it completes a latent.

        Raises:
            DataError: `frame.size_mismatch`: a picture is not of the camera that was announced.
            ValueError: there is no picture, or reset was not called.
        """
        found = {number: self._see(self._drives[number], one) for number, one in observations.items()}
        latents = {number: latent for number, latent in found.items() if latent is not None}
        plans: dict[int, Plan | None] = dict.fromkeys(observations)
        if latents:
            rgb = torch.stack(list(latents.values())).to(self._device)
            plans |= zip(latents, self._answers(list(latents), rgb, observations), strict=True)
        return plans

    def _new_drive(self) -> _Drive:
        return _Drive(episode=self._session.start())

    def _see(self, drive: _Drive, observation: Observation) -> torch.Tensor | None:
        if observation.rgb_u8 is None or self._camera is None:
            raise ValueError("the agent needs pictures, and reset before them; declare Sense.RGB")
        if drive.seen_step is None:
            drive.goal_m = goal_camera0_m(observation.goal_xy_m, drive.T_camera0_camera)
            drive.noise_key = observation.goal_xy_m.astype("<f8").tobytes()
        elif observation.step < drive.seen_step + self._config.steps_per_frame:
            return None
        drive.seen_step = observation.step
        return self._eye.see(drive.video, observation.rgb_u8, self._camera)

    def _answers(
        self, numbers: Sequence[int], rgb: torch.Tensor, observations: Mapping[int, Observation]
    ) -> list[Plan]:
        drives = [self._drives[number] for number in numbers]
        episodes = [drive.episode for drive in drives]
        states = self._session.observe(episodes, rgb, [self._known(drive) for drive in drives])
        for drive, estimate, number in zip(drives, states, numbers, strict=True):
            drive.T_camera0_camera = _transforms(estimate.poses)[-1]
            if observations[number].goal_frame == GoalFrame.CURRENT:
                drive.goal_m = goal_camera0_m(observations[number].goal_xy_m, drive.T_camera0_camera)
        goals = torch.from_numpy(np.stack([drive.goal_m for drive in drives])).float().to(self._device)
        noise = torch.stack([self._noise(drive, rgb.shape[1:]) for drive in drives]).to(self._device)
        dreams = self._session.dream(episodes, goals, noise, self._schedule)
        for row, (number, dream) in enumerate(zip(numbers, dreams, strict=True)):
            self._show(number, observations[number], rgb[row], dream)
        return [self._answer(drive, dream) for drive, dream in zip(drives, dreams, strict=True)]

    def _known(self, drive: _Drive) -> StateEstimate | None:
        return None if self._session.model.config.variant is Variant.SLAM else drive.issued

    def _noise(self, drive: _Drive, latent_shape: torch.Size) -> torch.Tensor:
        """Noise of one dream, [1, K, C, h, w]."""
        words = np.array([self._config.seed, drive.episode.observed], "<i8").tobytes()
        generator = torch.Generator().manual_seed(int(xxh3_64(words + drive.noise_key), 16))
        return torch.randn(1, self._config.session.chunk_size, *latent_shape, generator=generator)

    def _show(self, number: int, observation: Observation, seen: torch.Tensor, dream: Dream) -> None:
        if self.watcher is not None:
            self.watcher(number, observation, self._eye.pictures(seen, dream.rgb[0]))

    def _answer(self, drive: _Drive, dream: Dream) -> Plan:
        first = StateEstimate(first=dream.first, depth=None, poses=dream.poses[0, :1])
        drive.issued = first
        here, T_camera0_ahead = drive.T_camera0_camera, _transforms(dream.poses[0])
        ahead = path_in_base(here, T_camera0_ahead)
        stands = np.linalg.norm(ahead[-1]) < self._config.standing_m
        path = ahead[: self._config.executed_poses]
        followed = np.zeros((len(path) + 1, 2)) if stands else followed_path(path, self._config.turn_rad)
        goal = floor_points(transform_points(invert(here), drive.goal_m[None]))[0]
        return Plan(
            path_m=followed,
            candidates_m=ahead[None],
            goal_estimate_m=np.append(goal, 0.0),
            pose_estimate=floor_pose(here),
        )


def _transforms(poses: torch.Tensor) -> Float64Array:
    """Poses [..., 7] one after the other as matrices, float64 [N, 4, 4]."""
    return transforms_from_vectors(poses.double().cpu().numpy().reshape(-1, poses.shape[-1]))
