from dataclasses import replace

import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.tum.camera import camera_name, read_intrinsics
from wsm_data.schema.camera import Intrinsics


@pytest.fixture(scope="module")
def tum():
    return load_dataset("tum_rgbd")


@pytest.mark.parametrize(
    "text",
    [
        "# fx fy cx cy\n100.5 101 31.5 23.5\n",
        "100.5 0 31.5\n0 101 23.5\n0 0 1\n",
        "100.5 0 31.5 0\n0 101 23.5 0\n0 0 1 0\n0 0 0 1\n",
    ],
)
def test_the_camera_of_the_sequence_itself_wins(tmp_path, tum, text):
    (tmp_path / "camera.txt").write_text(text)
    found = read_intrinsics(tmp_path, "freiburg1", (64, 48), tum, "s")
    assert found == Intrinsics(fx=100.5, fy=101, cx=31.5, cy=23.5, width=64, height=48)


def test_else_it_is_the_published_one_that_the_folder_names(tmp_path, tum):
    camera = camera_name("rgbd_dataset_freiburg2_desk", tum)
    assert read_intrinsics(tmp_path, camera, (640, 480), tum, "s").fx == 520.9  # the benchmark's page
    assert camera_name("my_kitchen", tum) == "own"
    assert camera_name("office0", load_dataset("replica_sequences")) == "habitat"


def test_a_sequence_without_any_camera_is_told_what_to_add(tmp_path, tum):
    for camera, size in (("own", (640, 480)), ("freiburg1", (320, 240))):
        with pytest.raises(DataError, match=r"must have camera\.txt, or a published camera") as caught:
            read_intrinsics(tmp_path, camera, size, tum, "s")
        assert caught.value.reason is Reason.SEQUENCE_UNREADABLE
    bare = replace(tum, files=replace(tum.files, camera=""), cameras={})
    with pytest.raises(DataError, match=r"a camera file.*there is none"):
        read_intrinsics(tmp_path, "own", (640, 480), bare, "s")


@pytest.mark.parametrize("text", ["1 2 3", "a b c d", ""])
def test_what_is_no_camera_is_refused(tmp_path, tum, text):
    (tmp_path / "camera.txt").write_text(text)
    with pytest.raises(DataError) as caught:
        read_intrinsics(tmp_path, "own", (64, 48), tum, "s")
    assert caught.value.reason is Reason.SEQUENCE_UNREADABLE


def test_a_camera_of_other_images_is_a_misfit(tmp_path, tum):
    (tmp_path / "camera.txt").write_text("500 500 320 240")
    with pytest.raises(DataError) as caught:
        read_intrinsics(tmp_path, "own", (64, 48), tum, "s")
    assert caught.value.reason is Reason.INTRINSICS_MISFIT
