"""Scenes that did not come over whole, against what was done to them."""

import gzip
import shutil
from pathlib import Path

import pytest

from wsm_data.errors import Reason
from wsm_data.readers.interndata.reader import INTERNDATA
from wsm_data.readers.manifest import load_dataset

DATASET = load_dataset("synthetic")
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"


@pytest.fixture
def source(make_source, tmp_path):
    def copy(layout):
        made = make_source(cameras=("d435i",), layout=layout)
        return Path(shutil.copytree(made, tmp_path / layout))

    return copy


def look(source, walk=True):
    return [INTERNDATA.preflight(source, one, DATASET, walk) for one in INTERNDATA.find_containers(source, DATASET)]


def reasons(source, walk=True):
    return [refusal.reason for one in look(source, walk) for refusal in one.refusals]


@pytest.mark.parametrize("layout", ["scene_archive", "scene_folder", "trajectory_folder"])
def test_what_is_whole_is_counted_and_nothing_is_wrong(source, layout):
    found = look(source(layout))
    assert [one.refusals for one in found] == [()] * len(found)
    assert sum(one.trajectories for one in found) == 2
    assert all(one.walked and one.bytes_read > 0 for one in found)


def test_an_archive_that_was_cut_anywhere_is_found_read_or_not(source):
    """Its last 4 bytes are then compressed data, which look like the length of a tar once in 512 times."""
    archive = next(source("scene_archive").rglob("*.tar.gz"))
    whole = archive.read_bytes()
    for share in (0.2, 0.5, 0.9, 0.999):
        archive.write_bytes(whole[: int(share * len(whole))])
        for walk in (True, False):
            assert reasons(archive.parents[1], walk) == [Reason.ARCHIVE_TRUNCATED]


def test_a_whole_archive_is_not_read_where_it_need_not_be_and_one_in_two_streams_is(source):
    archive = next(source("scene_archive").rglob("*.tar.gz"))
    assert [(one.walked, one.refusals) for one in look(archive.parents[1], walk=False)] == [(False, ())]
    content = gzip.decompress(archive.read_bytes())
    archive.write_bytes(
        gzip.compress(content[:1000]) + gzip.compress(content[1000:-100]) + gzip.compress(content[-100:])
    )
    assert [(one.walked, one.refusals) for one in look(archive.parents[1], walk=False)] == [(True, ())]


@pytest.mark.parametrize("walk", [True, False])
def test_a_pointer_in_place_of_an_archive_is_found(source, walk):
    archive = next(source("scene_archive").rglob("*.tar.gz"))
    archive.write_bytes(POINTER)
    assert reasons(archive.parents[1], walk) == [Reason.ARCHIVE_POINTER_FILE]


@pytest.mark.parametrize(
    ("content", "reason"),
    [(POINTER, Reason.ARCHIVE_POINTER_FILE), (b"", Reason.FRAME_EMPTY), (None, Reason.FRAME_TRUNCATED)],
)
def test_images_that_are_not_whole_are_one_finding_a_reason(source, content, reason):
    root = source("scene_folder")
    for image in sorted(root.rglob("*.jpg"))[:5]:
        image.write_bytes(image.read_bytes()[:100] if content is None else content)
    (found,) = look(root)
    assert [(one.reason, one.details["files"]) for one in found.refusals] == [(reason, 5)]


@pytest.mark.parametrize(
    ("pattern", "reason"),
    [("*.parquet", Reason.EPISODE_MISSING), ("*.png", Reason.FRAME_COUNT_MISMATCH), ("*.*g", Reason.FRAME_MISSING)],
)
def test_what_is_missing_is_found_by_counts(source, pattern, reason):
    root = source("scene_folder")
    for folder in {path.parent for path in root.rglob(pattern)}:
        sorted(folder.glob(pattern))[-1].unlink()
    assert reasons(root) == [reason]
