import pyarrow as pa
import pytest

from wsm_data.curation.audit.content import repeated_content, scenes_in_several_splits
from wsm_data.curation.audit.finding import Severity
from wsm_data.curation.split import SplitBy


def index(*clips):
    """Rows of (key, split, scene, source digest, checksum of the members)."""
    columns = list(zip(*clips, strict=True))
    repeated = {"split": columns[1], "physical_scene": columns[2], "camera": ["zed"] * len(clips)}
    checksums = pa.array(columns[4], pa.uint64())
    return pa.table(
        {
            "key": columns[0],
            **{name: pa.array(values).dictionary_encode() for name, values in repeated.items()},
            "source_digest": columns[3],
            **dict.fromkeys(("rgb_latent_checksum", "depth_latent_checksum", "poses_checksum"), checksums),
        }
    )


SHARED = index(("a/1", "train", "s", "x", 1), ("a/2", "test", "s", "y", 2), ("a/3", "test", "t", "z", 3))


@pytest.mark.parametrize(
    ("promised", "severity"), [(SplitBy.TRAJECTORY, Severity.INFO), (SplitBy.SCENE, Severity.ERROR)]
)
def test_a_scene_in_two_splits_is_an_error_where_scenes_were_dealt(promised, severity):
    [found] = scenes_in_several_splits(SHARED, promised)
    assert (found.severity, found.clips) == (severity, ("a/1", "a/2"))
    assert "scene s has clips in several splits: 1 in test, 1 in train" in found.message


def test_clips_of_one_source_are_content_twice_across_splits_an_error():
    found = list(repeated_content(index(
        ("a/1", "train", "s", "x", 1), ("a/2", "train", "s", "x", 2), ("b/1", "train", "s", "y", 3),
        ("b/2", "test", "s", "y", 4), ("c/1", "test", "s", "z", 5),
    )))  # fmt: skip
    assert [(one.severity, one.clips) for one in found] == [
        (Severity.WARNING, ("a/1", "a/2")),
        (Severity.ERROR, ("b/1", "b/2")),
    ]
    assert found[1].message == "2 clips have the same source digest, in the splits test and train"


def test_equal_latents_and_poses_of_different_sources_are_content_twice():
    [found] = repeated_content(index(("a/1", "train", "s", "x", 7), ("a/2", "train", "s", "y", 7)))
    assert found.message == "2 clips have the same latents and poses, in train"


def test_clips_that_are_equal_in_both_ways_are_found_once():
    assert len(list(repeated_content(index(("a/1", "train", "s", "x", 7), ("a/2", "train", "s", "x", 7))))) == 1


def test_content_that_is_there_once_is_no_finding():
    assert list(repeated_content(SHARED)) == []
