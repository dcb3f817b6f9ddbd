"""The forms in which trajectories are published."""

from enum import StrEnum


class Layout(StrEnum):
    """How InternData-N1 lays out trajectories: archives of whole scenes, the same unpacked, a folder per trajectory."""

    SCENE_ARCHIVE = "scene_archive"
    SCENE_FOLDER = "scene_folder"
    TRAJECTORY_FOLDER = "trajectory_folder"
