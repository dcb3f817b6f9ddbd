import numpy as np
import pytest
import simplejpeg

from wsm_data.errors import ConfigError
from wsm_data.readers.manifest import load_dataset
from wsm_data.view.browser.source_shelf import SourceShelf


@pytest.fixture(scope="module")
def shelf(make_source) -> SourceShelf:
    return SourceShelf(make_source(), load_dataset("synthetic"))


@pytest.fixture(scope="module")
def place(shelf) -> tuple[str, str]:
    container = shelf.containers("d435i", 0, 1)["containers"][0]["id"]
    return container, shelf.container(container)["episodes"][0]["unit"]


def test_containers_are_listed_and_none_is_read(make_source, monkeypatch):
    shelf = SourceShelf(make_source(), load_dataset("synthetic"))
    monkeypatch.setattr(shelf, "_scans", None)
    found = shelf.containers("", 0, 50)
    assert found["total"] == len(found["containers"]) == shelf.about()["containers"] == 2  # two cameras in one home
    assert shelf.containers("ZED", 0, 50)["total"] == 1
    assert shelf.containers("", 1, 50)["containers"] == found["containers"][1:]


def test_a_container_gives_its_trajectories_and_what_is_refused(shelf, place):
    found = shelf.container(place[0])
    assert [len(found["episodes"]), found["refusals"]] == [2, []]
    assert found["episodes"][0]["has_depth"]


def test_the_page_of_a_trajectory_has_the_form_of_a_clips(shelf, place):
    page = shelf.page(*place)
    path = np.array(page["map"]["path"])
    assert len(path) == page["frames"]
    assert (path >= 0).all()
    assert (path <= [page["map"]["columns"], page["map"]["rows"]]).all()
    length_m = np.linalg.norm(np.diff(path, axis=0), axis=1).sum() * page["map"]["cell_m"]
    assert dict(page["facts"])["path length"] == f"{length_m:.2f} m"


def test_frames_are_the_images_of_the_source(shelf, place):
    page = shelf.page(*place)
    for kind in ("rgb", "depth"):
        picture = simplejpeg.decode_jpeg(shelf.frame(*place, kind, page["frames"] - 1))
        assert picture.shape == (page["height"], page["width"], 3)
    assert simplejpeg.decode_jpeg(shelf.thumbnail(*place)).shape[2] == 3
    with pytest.raises(ConfigError, match="has no rgb frame"):
        shelf.frame(*place, "rgb", page["frames"])


@pytest.mark.parametrize("container", ["../..", "/etc", ""])
def test_nothing_but_a_container_of_the_source_is_read(shelf, container):
    with pytest.raises(ConfigError, match="the source has no container"):
        shelf.container(container)


def test_a_trajectory_that_is_not_there_is_refused_with_the_nearest(shelf, place):
    with pytest.raises(ConfigError, match="did you mean"):
        shelf.page(place[0], place[1][:-1])


def test_a_refusal_is_found_where_its_container_has_the_trajectory(shelf, place):
    container, unit = place
    assert shelf.place_of(unit, container) == place
    assert shelf.place_of(f"{unit}9", container) is None
    assert shelf.place_of(unit, "elsewhere") is None
