"""The errors of the project, and the codes under which bad data is refused.

`WsmError` is foreseen and its message is for a person. Only `DataError` is survivable: the runner quarantines the
unit and goes on. Anything else is a bug and ends the run with a traceback.
"""

import re
from collections.abc import Mapping
from enum import StrEnum

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")

_SECRETS = (
    re.compile(r"(?<=://)[^/@:\s]*:[^/@\s]*(?=@)"),  # user:password@host, as of FTP and SFTP
    re.compile(r"(?<=https://)[^/@\s]+(?=@)|(?<=http://)[^/@\s]+(?=@)"),  # token@host; elsewhere it names a container
    re.compile(
        r"(?i)(?<=[?&;])(?:x-amz-[a-z-]+|x-goog-[a-z-]+|awsaccesskeyid|signature|sig|sv|se|[a-z_-]*(?:token|key|secret|passw)"
        r"[a-z_-]*)=[^&;\s]*"
    ),  # a signed URL
    re.compile(r"\bhf_[A-Za-z0-9]{16,}"),
)


def without_secrets(text: str) -> str:
    """A text in which whatever of a URL may be a credential is replaced by `***`."""
    for pattern in _SECRETS:
        text = pattern.sub("***", text)
    return text


def printable(text: str) -> str:
    """Text that a terminal, a file and a table take: control characters and halves of surrogates as escapes.

    Newlines and tabs stay. Names out of a source may hold anything, escape codes of a terminal among it.
    """
    return _CONTROL.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


class Reason(StrEnum):
    """Why a unit was refused, or what was noted about it. Tests and reports speak of these codes."""

    # containers: an archive, a scene folder, a trajectory folder
    ARCHIVE_POINTER_FILE = "archive.pointer_file"
    ARCHIVE_NOT_GZIP = "archive.not_gzip"
    ARCHIVE_UNREAD_FORM = "archive.unread_form"  # surely data, as .7z, .zip or in parts
    ARCHIVE_TRUNCATED = "archive.truncated"
    ARCHIVE_CORRUPT = "archive.corrupt"
    ARCHIVE_UNSAFE_MEMBER = "archive.unsafe_member"
    FILE_UNREADABLE = "file.unreadable"  # the system refuses: a link that leads nowhere, no permission, a broken disk
    FILE_LINK_LOOP = "file.link_loop"
    FILE_NOT_REGULAR = "file.not_regular"  # a pipe, a device or a socket
    FILE_TOO_LARGE = "file.too_large"
    CONTAINER_UNPARSABLE = "container.unparsable"  # what is in it makes a parser fail, or ask for too much memory
    CONTAINER_UNSTORABLE_NAME = "container.unstorable_name"
    CONTAINER_MISPLACED = "container.misplaced"
    CONTAINER_NO_EPISODES = "container.no_episodes"
    CONTAINER_SEVERAL_SCENES = "container.several_scenes"

    # episodes
    EPISODE_MISSING = "episode.missing"
    EPISODE_DUPLICATE = "episode.duplicate"
    EPISODE_SAME_CONTENT = "episode.same_content"
    EPISODE_TOO_SHORT = "episode.too_short"
    EPISODE_TOO_LONG = "episode.too_long"
    EPISODE_UNSTORABLE_NAME = "episode.unstorable_name"
    EPISODE_LENGTH_MISMATCH = "episode.length_mismatch"  # a note: episodes.jsonl disagrees with what is stored

    # frames
    FRAME_EMPTY = "frame.empty"
    FRAME_TRUNCATED = "frame.truncated"
    FRAME_UNDECODABLE = "frame.undecodable"
    FRAME_TOO_LARGE = "frame.too_large"
    FRAME_MISSING = "frame.missing"
    FRAME_COUNT_MISMATCH = "frame.count_mismatch"
    FRAME_SIZE_MISMATCH = "frame.size_mismatch"
    FRAME_REPEATED = "frame.repeated"  # a copy of another, between which the camera moved
    FRAME_OUT_OF_ORDER = "frame.out_of_order"  # it does not fit between its neighbours
    DEPTH_NOT_16_BIT = "depth.not_16_bit"
    COLOUR_BLANK = "colour.blank"
    COLOUR_DISAGREES = "colour.disagrees"  # colour images do not move as poses and depth images do
    DEPTH_NO_MEASUREMENT = "depth.no_measurement"
    DEPTH_SPARSE = "depth.sparse"
    DEPTH_COARSE = "depth.coarse"  # in steps, as of 8 bits in 16
    DEPTH_NOISY = "depth.noisy"

    # the parquet table of an episode
    TABLE_UNREADABLE = "table.unreadable"
    TABLE_TOO_LARGE = "table.too_large"
    TABLE_MISSING_COLUMN = "table.missing_column"
    TABLE_ROW_COUNT = "table.row_count"
    TABLE_ROW_ORDER = "table.row_order"
    TABLE_BAD_SHAPE = "table.bad_shape"
    POSE_NOT_FINITE = "pose.not_finite"
    POSE_NOT_RIGID = "pose.not_rigid"
    POSE_JUMP = "pose.jump"
    POSE_MOTION_DISAGREE = "pose.motion_disagree"  # poses stand still, or jump, where depth images do not
    POSE_DEPTH_DISAGREE = "pose.depth_disagree"
    POSE_OUT_OF_STEP = "pose.out_of_step"  # depth fits the poses of some frames earlier or later better
    INTRINSICS_MISFIT = "intrinsics.misfit"
    MOUNT_MISFIT = "mount.misfit"
    MOUNT_FLOOR_DISAGREE = "mount.floor_disagree"  # depth images see the floor at another height
    FLOOR_UNSEEN = "floor.unseen"  # a camera without a mount, and no floor in its depth

    # recorded sequences: lists of images and poses with their times
    SEQUENCE_UNREADABLE = "sequence.unreadable"
    SEQUENCE_UNASSOCIATED = "sequence.unassociated"  # a note where only some images have no depth or pose

    # estimated trajectories that are compared with true ones
    TRAJECTORY_UNREADABLE = "trajectory.unreadable"
    TRAJECTORY_UNMATCHED = "trajectory.unmatched"
    TRAJECTORY_DEGENERATE = "trajectory.degenerate"

    # episodes of a simulation
    START_BLOCKED = "start.blocked"

    # point clouds and maps
    CLOUD_MISSING = "cloud.missing"  # a note when the map is fused from depth instead
    CLOUD_UNREADABLE = "cloud.unreadable"
    CLOUD_HEADER = "cloud.header"
    CLOUD_EMPTY = "cloud.empty"
    CLOUD_NO_OBSTACLES = "cloud.no_obstacles"
    CLOUD_DISAGREES = "cloud.disagrees"  # it shows another place than depth images do
    CLOUD_MISALIGNED = "cloud.misaligned"  # it fits depth images, and clearly better with other poses or another scale
    MAP_TOO_LARGE = "map.too_large"
    PATH_OFF_MAP = "path.off_map"  # the path leads over floor that the cloud never showed
    PATH_THROUGH_OBSTACLE = "path.through_obstacle"
    GOAL_UNREACHABLE = "goal.unreachable"
    GOAL_NOT_REACHED = "goal.not_reached"  # the source states a goal, and the expert ends elsewhere

    # latents of a release that are not those of its source today
    LATENT_SOURCE_CHANGED = "latent.source_changed"
    LATENT_START_CHANGED = "latent.start_changed"
    LATENT_RESIZE_CHANGED = "latent.resize_changed"
    LATENT_DTYPE_CHANGED = "latent.dtype_changed"
    LATENT_CHANNELS_CHANGED = "latent.channels_changed"
    LATENT_CODEC_CHANGED = "latent.codec_changed"


class WsmError(Exception):
    """A foreseen failure. The message says what must hold, what was found, where, and what to do, and no credential."""

    exit_code = 1

    def __init__(self, message: str):
        super().__init__(without_secrets(printable(message)))


class ConfigError(WsmError):
    """The request itself is wrong; raised before any work is done."""

    exit_code = 2


class BudgetExceeded(WsmError):
    """More units were refused than the run allows."""

    exit_code = 3


class IntegrityError(WsmError):
    """Stored bytes disagree with an index, a checksum, a fingerprint or a version."""

    exit_code = 4


class StoreError(WsmError):
    """A remote store refuses, or does not give what it holds after all attempts."""

    exit_code = 5


class Preempted(WsmError):
    """The system asked the program to end (SIGTERM): what was done is saved, and the same command goes on."""

    exit_code = 143  # as of a program that SIGTERM ends: a scheduler requeues it


class NumericalError(WsmError):
    """A value that must be finite is not: training stops, and what was saved before stays as it is."""

    exit_code = 6


class RemotePlannerError(WsmError):
    """A planner behind a URL is not there, or does not take a reset: its answers would be of another episode."""

    exit_code = 7


class DataError(WsmError):
    """This unit is unusable: it is quarantined under `reason`, and the run goes on.

    Args:
        reason: the code under which the refusal is counted.
        message: what must hold, what was found, where, and what to do.
        details: the measured numbers and names behind the message; arrays, NaN and paths are allowed.
    """

    def __init__(self, reason: Reason, message: str, details: Mapping[str, object] | None = None):
        super().__init__(message)
        self.reason = reason
        self.message = str(self)
        self.details = dict(details or {})

    def __reduce__(self) -> tuple[type["DataError"], tuple[Reason, str, dict[str, object]]]:
        """Cross a process boundary whole; the default keeps only the message."""
        return DataError, (self.reason, self.message, self.details)
