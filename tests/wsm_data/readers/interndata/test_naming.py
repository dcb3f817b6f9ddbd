import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.readers.interndata.naming import ImageSpan, Kind, Role, episode_name, frame_numbers, role_of, scene_offset

RGB, DEPTH = "videos/chunk-002/observation.images.rgb", "videos/chunk-002/observation.images.depth"


@pytest.mark.parametrize(
    ("name", "role"),
    [
        (f"{RGB}/episode_000012_007.jpg", Role(Kind.RGB, "", 12, 7)),
        (f"{RGB}/episode_000012_1007.jpeg", Role(Kind.RGB, "", 12, 1007)),
        (f"{RGB}/10.jpg", Role(Kind.RGB, "", None, 10)),
        (f"{DEPTH}/episode_000000_000.png", Role(Kind.DEPTH, "", 0, 0)),
        (f"trajectory_07/{DEPTH}/3.png", Role(Kind.DEPTH, "trajectory_07", None, 3)),
        ("data/chunk-001/episode_000003.parquet", Role(Kind.TABLE, "", 3, None)),
        ("t/data/chunk-001/episode_000003.parquet", Role(Kind.TABLE, "t", 3, None)),
        ("meta/pointcloud.ply", Role(Kind.CLOUD, "", None, None)),
        ("data/chunk-000/path.ply", Role(Kind.CLOUD, "", None, None)),
        ("t/meta/pointcloud.ply", Role(Kind.CLOUD, "t", None, None)),
        ("t/data/chunk-000/path.ply", Role(Kind.CLOUD, "t", None, None)),
        ("meta/episodes.jsonl", Role(Kind.LENGTHS, "", None, None)),
        ("meta/episodes_stats.jsonl", Role(Kind.STATS, "", None, None)),
    ],
)
def test_a_name_says_what_a_file_is(name, role):
    assert role_of(name) == role


@pytest.mark.parametrize(
    "name",
    [
        "videos/chunk-000/observation.video.rgb/episode_000000.mp4",  # lossy: never read
        "videos/chunk-000/observation.video.depth/episode_000000.mp4",
        f"{RGB}/episode_000000_000.png",
        f"{RGB}/thumbnail.jpg",
        f"{DEPTH}/1.png.part",
        "data/chunk-000/._episode_000000.parquet",
        "meta/info.json",
        "a/b/data/chunk-000/episode_000000.parquet",
    ],
)
def test_other_files_have_no_role(name):
    assert role_of(name) is None


@pytest.mark.parametrize(
    ("folder", "episode"),
    [("trajectory_07", "000007"), ("traj12", "000012"), ("3", "000003"), ("kitchen", "kitchen"), ("7_back", "7_back")],
)
def test_a_trajectory_folder_names_the_same_episode_as_a_scene_does(folder, episode):
    assert episode_name(folder) == episode


@given(st.permutations(range(5, 17)))
def test_frames_are_in_the_order_of_their_numbers(numbers):
    assert frame_numbers(numbers, 5, None, "a") == list(range(5, 17))
    assert frame_numbers(numbers, 7, 12, "a") == list(range(7, 13))


@given(st.integers(2, 30).flatmap(lambda n: st.tuples(st.just(n), st.integers(0, n - 2))))
def test_any_gap_before_the_last_frame_is_named(count_and_gap):
    count, gap = count_and_gap
    with pytest.raises(DataError) as caught:
        frame_numbers([number for number in range(count) if number != gap], 0, None, "a")
    assert caught.value.reason is Reason.FRAME_MISSING
    assert caught.value.details == {"missing": 1, "first_missing": gap}


def test_an_episode_without_images_is_missing_them():
    with pytest.raises(DataError) as caught:
        frame_numbers([1, 2], 5, 9, "a")
    assert caught.value.reason is Reason.FRAME_MISSING


SPANS = {0: ImageSpan(0, 4), 1: ImageSpan(5, 9)}


def test_positions_become_numbers_where_that_is_certain():
    assert scene_offset(range(10), SPANS, "a") == 0
    assert scene_offset(range(3, 13), SPANS, "a") == 3  # complete, wherever it starts
    assert scene_offset([0, 1, 9], SPANS, "a") == 0  # incomplete, but number 0 is there
    with pytest.raises(DataError) as caught:
        scene_offset(range(1, 10), SPANS, "a")
    assert caught.value.reason is Reason.FRAME_MISSING
