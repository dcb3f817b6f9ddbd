"""A run behind a URL goes on from another machine, and its release is that of a run on a disk to the byte."""

import traceback

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.release import open_release

WORDS = ("--set", "index.depth_sample_every=2", "--set", "encode.clip.width=96", "--set", "encode.clip.height=64")
STAGES = """summary = "up to the release"
stages = ["index", "split", "map", "encode", "pack"]

[index]
dataset = "synthetic"
"""


@pytest.fixture
def run(tmp_path, make_source):
    (tmp_path / "short.toml").write_text(STAGES)
    source = make_source(cameras=("d435i",))

    def call(*words, code=0):
        options = (*WORDS, "--set", f"source={source}", "--max-refused", "0.9", "-q", "-w", "1")
        done = CliRunner().invoke(app, ["run", str(tmp_path / "short.toml"), *options, *(str(word) for word in words)])
        assert done.exit_code == code, (done.output, traceback.format_exception(done.exception))
        return " ".join(done.output.split())

    return call


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_another_machine_goes_on_from_what_is_there(run, tmp_path):
    url = f"memory://run-{tmp_path.name}"
    run("--out", tmp_path / "plain")
    first = run("--out", url, "--work", tmp_path / "first")
    assert f"pack: files sent to {url}/pack: " in first
    assert open_release(f"{url}/pack/release").digest == open_release(tmp_path / "plain/pack/release").digest
    second = run("--out", url, "--work", tmp_path / "second")
    assert f"encode: files brought from {url}/encode: " in second
    assert f"pack: files sent to {url}/pack: 1" in second  # stage.json, which says where the folders are
    assert contents(tmp_path / "second/pack/release") == contents(tmp_path / "plain/pack/release")


def test_a_url_needs_a_folder_to_work_in_and_a_path_needs_none(run, tmp_path):
    assert "add --work FOLDER" in run("--out", "memory://run", code=2)
    assert "leave it out" in run("--out", tmp_path / "run", "--work", tmp_path / "work", code=2)
    assert not (tmp_path / "run").exists()


def test_a_url_that_nothing_knows_is_refused_before_any_work(run, tmp_path):
    assert "cannot be opened" in run("--out", "nowhere://run", "--work", tmp_path / "work", code=2)
    assert not (tmp_path / "work").exists()
