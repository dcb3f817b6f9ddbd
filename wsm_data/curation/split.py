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


def split_together(
    digests: Mapping[EpisodeId, str], by: SplitBy, test_fraction: float, seed: int
) -> dict[EpisodeId, str]:
    """Sides of trajectories: `test` where the hash of a name, as a number in [0, 1), lies below `test_fraction`.

    By trajectory the name is the episode's id (the paper's split, section 4.1). By scene it is the physical scene's
    name, the same under every camera, so that no view of a test scene is trained on.

    Trajectories of equal content go to one side, that of the shortest name of them, the first. By scene, so do the
    scenes that share content, whole: what a scene shares with a second and this with a third binds all three.

    Args:
        digests: content digest of each trajectory.
        by: what is dealt as a whole.
        test_fraction: expected share of the test side.
        seed: another seed, another deal.
    """
    bound: dict[str, str] = {}  # a name to one that decides for it, in steps
    first: dict[str, str] = {}  # a content to the name it was first met under
    for episode, digest in digests.items():
        name = _dealt_name(episode, by)
        one, other = _decider(bound, name), _decider(bound, first.setdefault(digest, name))
        decides, follows = sorted((one, other), key=shortest_first)
        if follows != decides:
            bound[follows] = decides
    return {one: _side(_decider(bound, _dealt_name(one, by)), test_fraction, seed) for one in digests}


def shortest_first(name: str) -> tuple[int, str]:
    """Order of names of equal content: a copy is called longer (`home (1)`) than what it is a copy of."""
    return len(name), name


def _decider(bound: Mapping[str, str], name: str) -> str:
    while name in bound:
        name = bound[name]
    return name


def _dealt_name(episode: EpisodeId, by: SplitBy) -> str:
    return episode.physical_scene if by is SplitBy.SCENE else episode.text


def _side(name: str, test_fraction: float, seed: int) -> str:
    digest = hashlib.sha256(f"{seed}:{name}".encode()).digest()
    return TEST if int.from_bytes(digest[:8], "big") < test_fraction * 2**64 else TRAIN


def leaking_scenes(splits: Mapping[EpisodeId, str]) -> tuple[str, ...]:
    """Physical scenes that occur on both sides, sorted."""
    sides = {side: {one.physical_scene for one, split in splits.items() if split == side} for side in (TRAIN, TEST)}
    return tuple(sorted(sides[TRAIN] & sides[TEST]))
