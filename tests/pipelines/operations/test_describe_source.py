import json
from itertools import chain

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.describe_source import describe_source
from pipelines.operations.soundness.source_manifest import GUESSES
from wsm_data.errors import ConfigError, Reason
from wsm_data.readers.manifest import MANIFEST_FOLDER

TILT = "-0.9238795325 0 0 0.3826834324"
"""Rotation about x by -135 degrees: the optical axis points along y and 45 degrees down."""


def sequence(folder, *, frames=8, jump_m=0.0):
    """A camera that looks down and goes 0.1 m a frame along y, 1 m above the floor."""
    (folder / "rgb").mkdir(parents=True)
    (folder / "depth").mkdir()
    lists, poses = {"rgb": [], "depth": []}, []
    for i in range(frames):
        for kind, image in (("rgb", np.zeros((96, 128, 3), np.uint8)), ("depth", _floor_below())):
            cv2.imwrite(str(folder / kind / f"{i}.png"), image)
            lists[kind].append(f"{i / 10} {kind}/{i}.png")
        poses.append(f"{i / 10} 0 {0.1 * i + jump_m * (i > 4)} 1 {TILT}")
    for kind, lines in lists.items():
        (folder / f"{kind}.txt").write_text("\n".join(lines))
    (folder / "groundtruth.txt").write_text("\n".join(poses))
    (folder / "camera.txt").write_text("96 96 63.5 47.5")


def _floor_below():
    """A floor 1 m below a camera that is pitched down by 45 degrees: depth 1 / (sin 45 (1 + y))."""
    y = (np.arange(96) - 47.5) / 96
    depth_m = 1 / (np.sqrt(0.5) * (1 + y))
    return np.tile(np.rint(5000 * depth_m)[:, None], (1, 128)).astype(np.uint16)


def test_all_shipped_manifests_are_tried():
    assert sorted(chain(*GUESSES)) == sorted(path.stem for path in MANIFEST_FOLDER.glob("*.toml"))


def test_a_sequence_is_known_by_its_files_and_counted(tmp_path):
    sequence(tmp_path / "one")
    found = describe_source(tmp_path, "", 0)
    assert (found.dataset, found.reader, found.containers, found.trajectories) == ("tum_rgbd", "tum", 1, 1)
    assert found.frames == 8
    assert found.cameras == {"own 128 x 96 px, fx 96": 1}
    assert "bonn_rgbd" in found.fits


def test_what_would_be_refused_is_named_with_its_reason_and_nothing_is_written(tmp_path):
    sequence(tmp_path / "jumps", jump_m=3.0)
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "rgb.txt").write_text("# nothing\n")
    before = sorted(tmp_path.rglob("*"))
    done = CliRunner().invoke(app, ["source", "describe", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    refusals = {one["source"]: one["reason"] for one in json.loads(done.output)["refusals"]}
    assert refusals == {"empty": Reason.SEQUENCE_UNREADABLE, "jumps": Reason.POSE_JUMP}
    assert sorted(tmp_path.rglob("*")) == before


def test_a_limit_reads_only_so_many_containers(tmp_path):
    for name in "abc":
        sequence(tmp_path / name)
    found = describe_source(tmp_path, "tum_rgbd", 2)
    assert (found.containers, found.read, found.trajectories) == (3, 2, 2)


def test_generated_scenes_are_known_as_interndatas(make_source):
    found = describe_source(make_source(), "", 1)
    assert (found.dataset, found.with_cloud, found.trajectories) == ("interndata_n1", 1, 2)


def test_a_folder_that_is_no_source_names_what_every_reader_looks_for(tmp_path):
    with pytest.raises(ConfigError, match=r"(?s)arrays: .*episode\.json"):
        describe_source(tmp_path, "", 0)


def test_folders_that_only_look_like_a_source_are_told_so(tmp_path):
    (tmp_path / "photos" / "summer").mkdir(parents=True)
    done = CliRunner().invoke(app, ["source", "describe", str(tmp_path)])
    assert done.exit_code == 0
    assert "nothing can be used; is it another layout?" in done.output
    assert "tum: a sequence" in done.output
