"""How the agent drives; the paper's section on inference, and decisions where it is silent."""

from dataclasses import dataclass, field

from wsm_data.schema.sequence import POSE_SLOTS
from wsm_model.inference.session import SessionConfig
from wsm_model.precision import Precision


@dataclass(frozen=True, kw_only=True)
class AgentConfig:
    """Settings of the agent.

    Attributes:
        precision: of the matrix products, and of the weights that they take.
        seed: the noise that dreams start from follows from it.
        flow_steps: sampler steps of a dream (paper: 8).
        flow_shift: gamma of the flow times; as in training.
        session: chunk size, cache and backend of the estimation.
        executed_poses: predicted poses that are followed before it plans again (paper: 4); it plans with every latent,
            so more of them only lengthen the path that an answer that is late leaves to follow.
        steps_per_frame: control steps between two frames that the model sees. The model was trained on frames a fixed
            way apart, 0.03 to 0.06 m in generated homes. One control step of the benchmark at full speed is 0.075 m,
            but a path of four such poses is driven within four control steps, so that frames come as in training.
            More than 1 is for robots that are controlled faster.
        standing_m: a dream whose net motion is below this is the wish to stand still (paper silent).
        turn_rad: where the followed path ends at a greater bearing than this, the answer is the turn command: the
            benchmark's controller stands still before a path behind it, and drives none from 95 degrees on.
    """

    precision: Precision = Precision.FLOAT32
    seed: int = 0
    flow_steps: int = 8
    flow_shift: float = 5.0
    session: SessionConfig = field(default_factory=SessionConfig)
    executed_poses: int = POSE_SLOTS
    steps_per_frame: int = 1
    standing_m: float = 0.05
    turn_rad: float = 1.3

    def __post_init__(self) -> None:
        if self.flow_steps < 1 or self.steps_per_frame < 1:
            raise ValueError(
                f"flow_steps and steps_per_frame must be at least 1, found {self.flow_steps} and {self.steps_per_frame}"
            )
        most = POSE_SLOTS * self.session.chunk_size
        if not 1 <= self.executed_poses <= most:
            raise ValueError(f"a dream has {most} poses: executed_poses must be 1 to {most}, not {self.executed_poses}")
