"""`wsm select` from the command line, with its report and the selection as a release of its own."""

import re

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.operations.materialise import STAGE, MaterialiseConfig
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.stages.verify import require_sound
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import read_selection

QUIET = RunOptions(quiet=True)


@pytest.fixture
def wsm(release, tmp_path, monkeypatch):
    """Runs `wsm select` on the release in an empty folder; returns exit code and output."""
    monkeypatch.chdir(tmp_path)

    def go(*words):
        done = CliRunner().invoke(app, ["select", str(release), "-q", "--set", "fraction=0.5", *words])
        return done.exit_code, done.output

    return go


def test_one_command_selects_reports_and_materialises(wsm, release, tmp_path):
    code, output = wsm("--report", "--materialise", "own")
    assert code == 0, output
    own = open_release(tmp_path / "own" / "release")
    assert "selection: select/hard/hard.parquet" in output
    assert "report: select/hard/hard.html" in output
    assert re.search(r"release: own/release, \d clips, verified", output)
    parent = open_release(release)
    digest = release_digest(parent.manifest)
    assert own.manifest.parent == digest
    assert sorted(own.index.texts("key")) == sorted(read_selection(release, "hard", digest).keys.to_pylist())
    assert (tmp_path / "select/hard/hard.html").read_text().startswith("<!DOCTYPE html>")


def test_selections_of_different_names_have_folders_of_their_own(wsm, tmp_path):
    assert wsm()[0] == wsm("--set", "name=other")[0] == 0
    assert sorted(path.name for path in (tmp_path / "select").iterdir()) == ["hard", "other"]


def test_a_dry_run_writes_nothing(wsm, tmp_path):
    code, output = wsm("--dry-run", "--report", "--materialise", "own")
    assert code == 0
    assert "fraction" in output
    assert not (tmp_path / "select").exists()
    assert not (tmp_path / "own").exists()


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("fraction=0", "fraction must be above 0"),
        ("name=a/b", "the name of a selection"),
        ("quotas.camera.at_least=99", "camera"),
    ],
)
def test_a_wrong_setting_ends_with_code_2_and_names_it(wsm, word, message):
    code, output = wsm("--set", word)
    assert (code, message in output) == (2, True)


def test_a_killed_copy_goes_on_where_it_stopped(wsm, release, tmp_path):
    """One shard of two is gone and the release unfinished: the other shard is kept, the bytes are those of one run."""
    wsm("--set", "fraction=1.0", "--set", "diversity.within_m=0")
    config = MaterialiseConfig(release=str(release), selection="hard", shard_mib=1)
    whole = run_stage(STAGE, config, tmp_path / "own", QUIET).out / "release"
    files = {path.name: path.read_bytes() for path in whole.iterdir()}
    lost = sorted(whole.glob("*.tar"))[0]
    lost.unlink()
    (whole / "dataset.json").unlink()
    report = run_stage(STAGE, config, tmp_path / "own", QUIET)
    assert report.ran == (lost.name,)
    assert {path.name: path.read_bytes() for path in whole.iterdir()} == files
    assert require_sound(str(whole), quiet=True) == open_release(release).manifest.clips_by_split["train"]


def test_another_selection_in_the_same_folder_replaces_the_first(wsm, release, tmp_path):
    wsm("--materialise", "own")
    first = open_release(tmp_path / "own" / "release").manifest
    wsm("--set", "name=all", "--set", "fraction=1.0", "--set", "diversity.within_m=0", "--materialise", "own")
    second = open_release(tmp_path / "own" / "release").manifest
    assert second.clips > first.clips
    assert second.fingerprints["selection"] != first.fingerprints["selection"]


def test_a_selection_that_is_not_there_is_refused_before_any_work(wsm, release):
    wsm()
    with pytest.raises(ConfigError, match=r"there is no selection at .*easy\.parquet; it has hard"):
        STAGE.list_units(MaterialiseConfig(release=str(release), selection="easy"))
