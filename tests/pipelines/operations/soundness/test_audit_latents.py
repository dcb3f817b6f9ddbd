import json
import shutil
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.soundness.audit_latents import sampled_rows
from wsm_data.access.release import open_release
from wsm_data.readers.arrays import write_episode

sys.path.insert(0, str(Path(__file__).parents[3] / "wsm_data" / "fakes"))

from hand_held import CAMERA, walk_frames


@pytest.fixture(scope="module")
def source(make_source):
    return make_source(cameras=("d435i",), layout="scene_folder")


@pytest.fixture(scope="module")
def release(source, run_pipeline, tmp_path_factory):
    out = tmp_path_factory.mktemp("audited")
    run_pipeline(source, out)
    return out / "pack" / "release"


def audit(release, source, *words, dataset="synthetic"):
    words = ["audit-latents", str(release), "--source", str(source), "--dataset", dataset, *words, "--quiet"]
    return CliRunner(env={"GITHUB_ACTIONS": ""}).invoke(app, words)


def test_latents_of_a_release_are_those_of_its_source(release, source):
    done = audit(release, source, "--share", "1", "--json")
    assert done.exit_code == 0, done.output
    units = json.loads(done.stdout)["units"]
    assert len(units) == len(open_release(release).index) > 0
    assert all(unit["verdicts"]["latents"]["measured"]["rgb_difference"] < 3e-4 for unit in units)


def test_a_trajectory_that_changed_and_one_that_is_gone_are_findings(release, source, tmp_path):
    changed = shutil.copytree(source, tmp_path / "changed")
    image = next(changed.rglob("*.jpg"))
    image.write_bytes(image.read_bytes().replace(b"\xff\xd9", b"\xff\xfe\x00\x03x\xff\xd9"))  # a comment segment
    done = audit(release, changed, "--share", "1")
    assert done.exit_code == 3, done.output
    assert done.stdout.count("latent.source_changed: ") == 2  # a finding, and the count of the code


def test_a_share_takes_at_least_one_clip_and_the_same_ones_of_a_larger_share(release):
    opened = open_release(release)
    few, all_ = (sampled_rows(opened, share) for share in (1e-6, 1.0))
    assert len(few) == 1
    assert all_[:1] == few


def test_a_floor_that_a_run_found_in_depth_is_found_again(run_pipeline, tmp_path):
    """It is part of the digest of a trajectory, and follows from the depth images that are sampled."""
    write_episode(tmp_path / "source", "home", "one", walk_frames(60), K=CAMERA.matrix, camera="cam")
    settings = {"index": {"dataset": "arrays", "depth_sample_every": 3}, "split": {"test_fraction": 0.0}}
    run_pipeline(tmp_path / "source", tmp_path / "run", settings=settings)
    done = audit(tmp_path / "run" / "pack" / "release", tmp_path / "source", dataset="arrays")
    assert done.exit_code == 0, done.output
