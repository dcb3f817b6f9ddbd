from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.shards.shard_layout import PlacedClip, lay_out_shards

CLIPS = st.lists(
    st.builds(
        PlacedClip,
        key=st.text("abc/", min_size=1, max_size=8),
        split=st.sampled_from(["train", "test"]),
        size_bytes=st.integers(1, 400).map(lambda blocks: 512 * blocks),
    ),
    unique_by=lambda clip: clip.key,
    max_size=40,
)


@given(CLIPS, st.integers(2048, 200_000), st.integers(0, 3))
def test_every_clip_is_placed_once_in_a_shard_of_its_split(clips: list[PlacedClip], limit: int, seed: int) -> None:
    layouts = lay_out_shards(clips, shard_bytes=limit, seed=seed)
    assert Counter(clip for layout in layouts for clip in layout.clips) == Counter(clips)
    assert all(clip.split == layout.split for layout in layouts for clip in layout.clips)


@given(CLIPS, st.integers(2048, 200_000))
def test_no_shard_exceeds_its_size_but_one_of_a_single_clip(clips: list[PlacedClip], limit: int) -> None:
    for layout in lay_out_shards(clips, shard_bytes=limit):
        assert layout.size_bytes == sum(clip.size_bytes for clip in layout.clips) + 1024
        assert layout.size_bytes <= limit or len(layout.clips) == 1


@given(CLIPS, st.integers(2048, 200_000))
def test_no_shard_is_closed_while_the_next_clip_still_fits(clips: list[PlacedClip], limit: int) -> None:
    layouts = lay_out_shards(clips, shard_bytes=limit)
    for layout, following in pairwise(layouts):
        if layout.split == following.split:
            assert layout.size_bytes + following.clips[0].size_bytes > limit


@given(st.data())
def test_the_layout_does_not_depend_on_the_order_of_the_input(data: st.DataObject) -> None:
    clips = data.draw(CLIPS)
    assert lay_out_shards(data.draw(st.permutations(clips)), shard_bytes=9000) == lay_out_shards(
        clips, shard_bytes=9000
    )


@given(CLIPS.filter(lambda clips: len(clips) > 1), st.integers(0, 3))
def test_one_clip_less_leaves_the_order_of_the_others(clips: list[PlacedClip], seed: int) -> None:
    def order(chosen: list[PlacedClip]) -> list[str]:
        return [clip.key for layout in lay_out_shards(chosen, seed=seed) for clip in layout.clips]

    assert order(clips[1:]) == [key for key in order(clips) if key != clips[0].key]


def _scenes(count: int) -> list[PlacedClip]:
    return [
        PlacedClip(key=f"g/s{scene}/{episode}", split="train", size_bytes=512)
        for scene in range(count)
        for episode in range(count)
    ]


def test_clips_of_a_scene_are_spread_over_the_shards() -> None:
    layouts = lay_out_shards(_scenes(20), shard_bytes=1024 + 20 * 512)
    assert len(layouts) == 20
    # 20 clips drawn without order from 20 scenes hold about 12.8 scenes; sorted by scene it would be one
    assert min(len({clip.key.split("/")[1] for clip in layout.clips}) for layout in layouts) >= 8


def test_another_seed_gives_another_order_of_the_same_clips() -> None:
    first, second = lay_out_shards(_scenes(5), seed=0), lay_out_shards(_scenes(5), seed=1)
    assert first != second
    assert set(first[0].clips) == set(second[0].clips)


def test_shards_are_numbered_within_their_split() -> None:
    clips = [PlacedClip(key=str(n), split="train" if n % 3 else "test", size_bytes=512) for n in range(9)]
    names = [layout.name for layout in lay_out_shards(clips, shard_bytes=1024 + 3 * 512)]
    assert names == ["test-000000.tar", "train-000000.tar", "train-000001.tar"]


def test_a_key_that_occurs_twice_is_a_bug_even_in_two_splits() -> None:
    clips = [PlacedClip(key="a", split=split, size_bytes=512) for split in ("train", "test")]
    with pytest.raises(ValueError, match="found 'a' twice"):
        lay_out_shards(clips)
