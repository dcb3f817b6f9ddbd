"""Training and test by a hash of the name: a trajectory's side never depends on which others there are."""

import hashlib
from collections.abc import Mapping
from enum import StrEnum

from wsm_data.schema.identity import EpisodeId

TRAIN, TEST = "train", "test"


class SplitBy(StrEnum):
    """What is dealt as a whole."""

    TRAJECTORY = "trajectory"
    SCENE = "scene"


def split_of(episode: EpisodeId, by: SplitBy, test_fraction: float, seed: int) -> str:
    """`test` where the hash of the name, as a number in [0, 1), lies below `test_fraction`, else `train`.

    By trajectory the name is the episode's id (the paper's split, section 4.1). By scene it is the physical scene's
    name, the same under every camera, so that no view of a test scene is trained on.
    """
    name = episode.physical_scene if by is SplitBy.SCENE else episode.text
    digest = hashlib.sha256(f"{seed}:{name}".encode()).digest()
    return TEST if int.from_bytes(digest[:8], "big") < test_fraction * 2**64 else TRAIN


def leaking_scenes(splits: Mapping[EpisodeId, str]) -> tuple[str, ...]:
    """Physical scenes that occur on both sides, sorted."""
    sides = {side: {one.physical_scene for one, split in splits.items() if split == side} for side in (TRAIN, TEST)}
    return tuple(sorted(sides[TRAIN] & sides[TEST]))
