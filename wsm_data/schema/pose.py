"""How a pose is written: x, y, z (m) and a unit quaternion w, x, y, z."""

POSE_VALUES = 7
IDENTITY_POSE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
