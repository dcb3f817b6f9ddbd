"""How the camera of a source is carried, and which of its frames are worth keeping."""

import math
from dataclasses import dataclass
from enum import StrEnum


class CarriedBy(StrEnum):
    """Who carries the camera."""

    ROBOT = "robot"
    HAND = "hand"


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a source's camera moves; the defaults are those of a camera that is mounted on a wheeled robot.

    Attributes:
        carried_by: `robot`: the camera is mounted, and every pose must have the pitch of the mount. `hand`: height,
            pitch and roll are free within the limits of the manifest, and height and pitch of a trajectory are those
            of its first frame.
        floor_z_m: height of the floor in the source's world, m, where it is known; None: the reader takes it from the
            stated mount, or finds it in depth. InternData states mounts, and has no use for it.
        min_step_m: frames are left out until the camera has moved so far from the last one that is kept, m,
        min_turn_deg: or turned so far, degrees. 0 for both keeps every frame.
        max_frames: recordings with more frames than this are cut into several trajectories; 0: never.
    """

    carried_by: CarriedBy = CarriedBy.ROBOT
    floor_z_m: float | None = None
    min_step_m: float = 0.0
    min_turn_deg: float = 0.0
    max_frames: int = 0

    def __post_init__(self) -> None:
        for name in ("min_step_m", "min_turn_deg", "max_frames"):
            value = getattr(self, name)
            if not (value >= 0 and math.isfinite(value)):
                raise ValueError(f"{name} must be finite and not negative, found {value}")
