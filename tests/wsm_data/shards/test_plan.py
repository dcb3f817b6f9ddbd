from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.shards.plan import PlannedClip, plan_shards

CLIPS = st.lists(
    st.builds(
        PlannedClip,
        key=st.text("abc/", min_size=1, max_size=8),
        split=st.sampled_from(["train", "test"]),
        size_bytes=st.integers(1, 400).map(lambda blocks: 512 * blocks),
    ),
    unique_by=lambda clip: clip.key,
    max_size=40,
)


@given(CLIPS, st.integers(2048, 200_000), st.integers(0, 3))
def test_every_clip_is_planned_once_in_a_shard_of_its_split(clips: list[PlannedClip], limit: int, seed: int) -> None:
    plans = plan_shards(clips, shard_bytes=limit, seed=seed)
    assert Counter(clip for plan in plans for clip in plan.clips) == Counter(clips)
    assert all(clip.split == plan.split for plan in plans for clip in plan.clips)


@given(CLIPS, st.integers(2048, 200_000))
def test_no_shard_exceeds_its_size_but_one_of_a_single_clip(clips: list[PlannedClip], limit: int) -> None:
    for plan in plan_shards(clips, shard_bytes=limit):
        assert plan.size_bytes == sum(clip.size_bytes for clip in plan.clips) + 1024
        assert plan.size_bytes <= limit or len(plan.clips) == 1


@given(CLIPS, st.integers(2048, 200_000))
def test_no_shard_is_closed_while_the_next_clip_still_fits(clips: list[PlannedClip], limit: int) -> None:
    plans = plan_shards(clips, shard_bytes=limit)
    for plan, following in pairwise(plans):
        if plan.split == following.split:
            assert plan.size_bytes + following.clips[0].size_bytes > limit


@given(st.data())
def test_the_plan_does_not_depend_on_the_order_of_the_input(data: st.DataObject) -> None:
    clips = data.draw(CLIPS)
    assert plan_shards(data.draw(st.permutations(clips)), shard_bytes=9000) == plan_shards(clips, shard_bytes=9000)


@given(CLIPS.filter(lambda clips: len(clips) > 1), st.integers(0, 3))
def test_one_clip_less_leaves_the_order_of_the_others(clips: list[PlannedClip], seed: int) -> None:
    def order(chosen: list[PlannedClip]) -> list[str]:
        return [clip.key for plan in plan_shards(chosen, seed=seed) for clip in plan.clips]

    assert order(clips[1:]) == [key for key in order(clips) if key != clips[0].key]


def _scenes(count: int) -> list[PlannedClip]:
    return [
        PlannedClip(key=f"g/s{scene}/{episode}", split="train", size_bytes=512)
        for scene in range(count)
        for episode in range(count)
    ]


def test_clips_of_a_scene_are_spread_over_the_shards() -> None:
    plans = plan_shards(_scenes(20), shard_bytes=1024 + 20 * 512)
    assert len(plans) == 20
    # 20 clips drawn without order from 20 scenes hold about 12.8 scenes; sorted by scene it would be one
    assert min(len({clip.key.split("/")[1] for clip in plan.clips}) for plan in plans) >= 8


def test_another_seed_gives_another_order_of_the_same_clips() -> None:
    first, second = plan_shards(_scenes(5), seed=0), plan_shards(_scenes(5), seed=1)
    assert first != second
    assert set(first[0].clips) == set(second[0].clips)


def test_shards_are_numbered_within_their_split() -> None:
    clips = [PlannedClip(key=str(n), split="train" if n % 3 else "test", size_bytes=512) for n in range(9)]
    names = [plan.name for plan in plan_shards(clips, shard_bytes=1024 + 3 * 512)]
    assert names == ["test-000000.tar", "train-000000.tar", "train-000001.tar"]


def test_a_key_that_occurs_twice_is_a_bug_even_in_two_splits() -> None:
    clips = [PlannedClip(key="a", split=split, size_bytes=512) for split in ("train", "test")]
    with pytest.raises(ValueError, match="found 'a' twice"):
        plan_shards(clips)
