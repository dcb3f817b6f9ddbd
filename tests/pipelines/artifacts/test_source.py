"""What later stages know of the source: from the index they build on, never from a setting of their own."""

from dataclasses import fields, is_dataclass, replace
from enum import Enum
from pathlib import Path

import pytest
from box_room import DATASET, MANIFEST_TOML, along_x, scene_files, write_archive, write_folder

from pipelines.artifacts.layout import conventions_path
from pipelines.artifacts.source import conventions_digest, indexed_source
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.stages.index import STAGE, IndexConfig
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.readers.manifest import load_dataset
from wsm_data.schema.dataset import CameraModel


@pytest.fixture
def tree(tmp_path):
    """A scene of its own in each of the three layouts, and the manifest of the source."""
    loft, hall, den = (scene_files({0: along_x(frames=frames)}) for frames in (5, 6, 7))
    write_archive(tmp_path / "tree" / "box_zed" / "loft.tar.gz", loft)
    write_folder(tmp_path / "tree" / "box_zed" / "hall", hall)
    write_folder(tmp_path / "tree" / "box_zed" / "den" / "trajectory_07", den)
    (tmp_path / "rooms.toml").write_text(MANIFEST_TOML)
    return tmp_path / "tree"


def index(tree, out, dataset):
    run_stage(STAGE, IndexConfig(source=tree, dataset=dataset), out, RunOptions(quiet=True))


def test_the_source_is_where_the_index_found_it_whatever_the_working_folder(tree, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    index(Path("tree"), tmp_path / "index", "synthetic")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    source = indexed_source(tmp_path / "index")
    assert source.root == tree
    assert source.dataset.name == "synthetic"


def test_a_manifest_of_ones_own_is_found_from_another_working_folder_too(tree, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    index(tree, tmp_path / "index", "rooms.toml")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert indexed_source(tmp_path / "index").dataset == DATASET


def test_conventions_that_were_changed_since_the_index_are_not_applied_to_what_it_read(tree, tmp_path):
    index(tree, tmp_path / "index", str(tmp_path / "rooms.toml"))
    (tmp_path / "rooms.toml").write_text(MANIFEST_TOML.replace("1e-4", "1e-3"))
    assert indexed_source(tmp_path / "index").dataset == DATASET
    index(tree, tmp_path / "index", str(tmp_path / "rooms.toml"))
    assert indexed_source(tmp_path / "index").dataset.depth.metres_per_unit == 1e-3


@pytest.mark.parametrize("name", ["interndata_n1", "synthetic"])
def test_a_shipped_manifest_comes_back_as_it_was(tree, tmp_path, name):
    index(tree, tmp_path / "index", name)
    assert indexed_source(tmp_path / "index").dataset == load_dataset(name)


@pytest.mark.parametrize("damage", [None, "{", '{"name": "x"}', '{"name": "x", "colour": 1}'])
def test_conventions_that_are_gone_or_damaged_are_never_replaced_by_others(tree, tmp_path, damage):
    index(tree, tmp_path / "index", "synthetic")
    path = conventions_path(tmp_path / "index")
    path.unlink() if damage is None else path.write_text(damage)
    with pytest.raises(
        IntegrityError, match=r"conventions\.json must hold what `wsm index` wrote, found .* again from `wsm index`"
    ):
        indexed_source(tmp_path / "index")


def test_a_folder_that_is_no_finished_index_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="run `wsm index` first"):
        indexed_source(tmp_path)


def changed_values(value):
    """Copies of a manifest, each with one value changed at any depth, by dotted name."""
    for one in fields(value):
        old = getattr(value, one.name)
        if is_dataclass(old):
            yield from ((f"{one.name}.{name}", replace(value, **{one.name: new})) for name, new in changed_values(old))
        elif one.name != "bits":  # only 16 are supported
            yield one.name, replace(value, **{one.name: other(old)})


def other(old):
    """Another value of the same type."""
    match old:
        case None:
            return 0.5
        case Enum():
            return next(choice for choice in type(old) if choice is not old)
        case "opengl":
            return "opencv"
        case str():
            return f"{old}x"
        case int():
            return old + 1
        case float():
            return old / 2 + 0.013
        case tuple():
            return (*old[:-1], other(old[-1]))
        case dict():
            return {**old, "zed": CameraModel(width=64)} if not old else {}


ABOUT_THE_PUBLISHER = {"licence", "homepage", "expected_episodes"}


def test_whatever_a_manifest_says_about_the_data_is_in_its_digest():
    changes = {name: one for name, one in changed_values(DATASET) if name not in ABOUT_THE_PUBLISHER}
    assert {"camera_axes", "robot.radius_m", "cloud.obstacle_rgb", "depth.invalid_codes", "cameras"} <= set(changes)
    digests = {conventions_digest(changed) for changed in changes.values()}
    assert len(digests) == len(changes)
    assert conventions_digest(DATASET) not in digests


def test_what_a_manifest_says_about_its_publisher_is_not_in_its_digest():
    changes = {name: one for name, one in changed_values(DATASET) if name in ABOUT_THE_PUBLISHER}
    assert set(changes) == ABOUT_THE_PUBLISHER
    assert {conventions_digest(changed) for changed in changes.values()} == {conventions_digest(DATASET)}


def test_equal_manifests_have_equal_digests_in_whatever_order_their_cameras_stand():
    cameras = {"zed": CameraModel(width=64), "d435i": CameraModel(width=48)}
    backwards = dict(reversed(cameras.items()))
    first, second = (conventions_digest(replace(DATASET, cameras=one)) for one in (cameras, backwards))
    assert first == second != conventions_digest(DATASET)
