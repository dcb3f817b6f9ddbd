import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.split import TEST, TRAIN, SplitBy, leaking_scenes, split_together
from wsm_data.schema.identity import EpisodeId

NAMES = [
    EpisodeId(f"{source}_{camera}", f"scene_{scene}", f"{episode:06d}")
    for source in ("gibson", "hm3d")
    for camera in ("d435i", "zed")
    for scene in range(50)
    for episode in range(50)
]
SIGMAS = 4
"""A fair deal of independent names lies farther off once in 16,000 times; names and seeds here never change."""

FRACTIONS = st.floats(0, 1, exclude_max=True)
SEEDS = st.integers(0, 1 << 32)
IDS = st.builds(EpisodeId, *[st.text("abcdefgh_.0123456789", min_size=1).filter(lambda x: x not in (".", ".."))] * 3)


def split_of(name, by, test_fraction, seed):
    """Side of a trajectory whose content is there once."""
    return split_together({name: "its content"}, by, test_fraction, seed)[name]


def deal(names, by=SplitBy.TRAJECTORY, test_fraction=0.05, seed=0):
    return {name: split_of(name, by, test_fraction, seed) for name in names}


def held_out(splits):
    return {name for name, split in splits.items() if split == TEST}


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("fraction", [0.01, 0.05, 0.3])
def test_the_share_of_test_trajectories_is_the_fraction_that_was_asked_for(fraction, seed):
    expected = fraction * len(NAMES)
    sigma = math.sqrt(fraction * (1 - fraction) * len(NAMES))  # binomial
    assert abs(len(held_out(deal(NAMES, test_fraction=fraction, seed=seed))) - expected) <= SIGMAS * sigma


def test_the_share_of_test_scenes_is_the_fraction_that_was_asked_for():
    names = [EpisodeId("gibson_zed", f"scene_{scene}", "000000") for scene in range(10_000)]
    sigma = math.sqrt(0.05 * 0.95 * len(names))
    assert abs(len(held_out(deal(names, SplitBy.SCENE))) - 0.05 * len(names)) <= SIGMAS * sigma


def test_every_scene_gives_its_share_so_that_the_sides_are_alike():
    names = [EpisodeId("gibson_zed", "one", f"{episode:06d}") for episode in range(10_000)]
    sigma = math.sqrt(0.05 * 0.95 * len(names))
    assert abs(len(held_out(deal(names))) - 500) <= SIGMAS * sigma


def test_nothing_is_held_out_of_a_fraction_of_zero():
    assert held_out(deal(NAMES, test_fraction=0.0)) == set()


@given(episode=IDS, by=st.sampled_from(SplitBy), smaller=FRACTIONS, larger=FRACTIONS, seed=SEEDS)
def test_a_larger_fraction_holds_out_what_a_smaller_one_does(episode, by, smaller, larger, seed):
    smaller, larger = sorted((smaller, larger))
    if split_of(episode, by, smaller, seed) == TEST:
        assert split_of(episode, by, larger, seed) == TEST


def test_another_seed_is_another_deal_and_the_two_are_independent():
    first, second = held_out(deal(NAMES, test_fraction=0.5)), held_out(deal(NAMES, test_fraction=0.5, seed=1))
    expected, sigma = 0.25 * len(NAMES), math.sqrt(0.25 * 0.75 * len(NAMES))
    assert abs(len(first & second) - expected) <= SIGMAS * sigma


def test_the_deal_is_the_same_on_every_machine_and_for_ever():
    """What sha256("0:<name>") of a shell says, its first 16 digits over 16^16: released splits must not move."""
    found = held_out(deal(NAMES[:100]))
    assert sorted(name.text for name in found) == [
        "gibson_d435i/scene_1/000002",
        "gibson_d435i/scene_1/000012",
        "gibson_d435i/scene_1/000046",
    ]


def test_by_scene_all_cameras_and_trajectories_of_a_scene_go_to_one_side():
    splits = deal(NAMES, SplitBy.SCENE, test_fraction=0.3)
    sides = {}
    for name, split in splits.items():
        sides.setdefault(name.physical_scene, set()).add(split)
    assert len(sides) == 100
    assert {len(found) for found in sides.values()} == {1}
    assert {split for found in sides.values() for split in found} == {TRAIN, TEST}
    assert leaking_scenes(splits) == ()


def test_scenes_on_both_sides_are_named_once_for_all_their_cameras():
    def name(group, scene, episode):
        return EpisodeId(group, scene, episode)

    splits = {
        name("gibson_zed", "b", "000000"): TRAIN,
        name("gibson_d435i", "b", "000000"): TEST,
        name("gibson_zed", "a", "000000"): TEST,
        name("gibson_zed", "a", "000001"): TRAIN,
        name("gibson_zed", "c", "000000"): TEST,
        name("hm3d_zed", "c", "000000"): TRAIN,  # another building of the same name
    }
    assert leaking_scenes(splits) == ("gibson/a", "gibson/b")


def test_nothing_leaks_between_sides_that_are_empty():
    assert leaking_scenes({}) == ()


@given(
    contents=st.lists(st.integers(0, 6), min_size=1, max_size=12), by=st.sampled_from(SplitBy), seed=st.integers(0, 99)
)
def test_equal_content_is_never_on_both_sides_and_content_that_is_there_once_stays(contents, by, seed):
    """The reference merges sets of names until no two share a name or a content."""
    digests = {EpisodeId("gibson_zed", f"s{n % 5}", f"{n:06d}"): str(one) for n, one in enumerate(contents)}
    splits = split_together(digests, by, 0.5, seed)
    groups = [{one} for one in digests]
    name = (lambda one: one.physical_scene) if by is SplitBy.SCENE else (lambda one: one.text)
    bound = lambda a, b: any(digests[x] == digests[y] or name(x) == name(y) for x in a for y in b)  # noqa: E731
    while pair := next(((a, b) for a in groups for b in groups if a is not b and bound(a, b)), None):
        groups = [one for one in groups if one not in pair] + [pair[0] | pair[1]]
    for group in groups:
        decides = min(group, key=lambda one: (len(name(one)), name(one)))
        assert {splits[one] for one in group} == {split_of(decides, by, 0.5, seed)}
