"""Run twice, touched, killed: what is done is kept, and the bytes come out the same."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipelines.cli import app

WSM = [sys.executable, "-c", "from pipelines.cli import app; app()"]

RECIPE = """
stages = ["index", "split", "map", "encode", "pack", "verify"]
[index]
dataset = "synthetic"
[split]
test_fraction = 0.3
[encode]
quality_share = 0.5
[encode.clip]
width = 96
height = 64
[pack]
shard_mib = 1
"""


def ledger(folder: Path) -> list[str]:
    files = sorted(folder.glob("ledger*.jsonl"))
    return [json.loads(line)["unit"] for path in files for line in path.read_text().splitlines()]


def test_the_second_run_does_nothing(make_source, run_pipeline, file_digests, tmp_path):
    first = run_pipeline(make_source(), tmp_path)
    files = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file() and path.name != ".lock"}
    second = run_pipeline(make_source(), tmp_path)
    assert all(report.ran for report in first.values())
    assert {name: report.ran for name, report in second.items()} == dict.fromkeys(first, ())
    rewritten = {path.name for path, mtime in files.items() if path.stat().st_mtime_ns != mtime}
    assert rewritten <= {"stage.json"}


def test_a_touched_trajectory_redoes_exactly_what_follows_from_it(make_source, run_pipeline, file_digests, tmp_path):
    source = tmp_path / "source"
    shutil.copytree(make_source(layout="scene_folder", scenes=2), source)
    run_pipeline(source, tmp_path / "run")
    before = file_digests(tmp_path / "run")
    frame = sorted((source / "synth_d435i" / "home_0001").rglob("episode_000001_003.jpg"))[0]
    comment = b"\xff\xfe\x00\x03x"  # a segment that no decoder shows: the content is another all the same
    frame.write_bytes(frame.read_bytes()[:-2] + comment + frame.read_bytes()[-2:])
    reports = run_pipeline(source, tmp_path / "run")
    assert reports["index"].ran == ("synth_d435i/home_0001",)
    assert reports["split"].ran == ()
    assert reports["map"].ran == ()
    assert reports["encode"].ran == ("synth_d435i/home_0001/000001",)
    after = file_digests(tmp_path / "run")
    clips = {name for name in after if name.startswith("encode/clips/") and after[name] != before.get(name)}
    stem = "encode/clips/synth_d435i/home_0001/000001"
    assert clips == {f"{stem}.clip", f"{stem}.json"}
    shard_rows = reports["pack"].ran
    assert len(shard_rows) == 1


def test_a_touched_file_with_the_same_content_changes_nothing_further_down(make_source, run_pipeline, tmp_path):
    source = tmp_path / "source"
    shutil.copytree(make_source(layout="scene_folder"), source)
    run_pipeline(source, tmp_path / "run")
    os.utime(next((source / "synth_zed").rglob("*.jpg")))
    reports = run_pipeline(source, tmp_path / "run")
    assert reports["index"].ran == ("synth_zed/home_0001",)
    assert all(reports[name].ran == () for name in ("split", "map", "encode", "pack"))


def test_a_trajectory_that_left_the_source_leaves_the_release(make_source, run_pipeline, tmp_path):
    source = tmp_path / "source"
    shutil.copytree(make_source(layout="trajectory_folder"), source)
    run_pipeline(source, tmp_path / "run")
    shutil.rmtree(source / "synth_zed" / "home_0001" / "trajectory_00")
    run_pipeline(source, tmp_path / "run")
    assert ledger(tmp_path / "run" / "index").count("synth_zed/home_0001/trajectory_00") == 0
    manifest = json.loads((tmp_path / "run" / "pack" / "release" / "dataset.json").read_text())
    assert manifest["clips"] == 3
    assert not list((tmp_path / "run" / "encode" / "clips").rglob("synth_zed/home_0001/000000*"))


def _exists(pattern: str):
    return lambda run: any(run.glob(pattern))


def _has_lines(stage: str, count: int):
    return lambda run: len(ledger(run / stage)) >= count


KILL_POINTS = {
    "index finished, split not begun": _exists("index/episodes.jsonl"),
    "map, an output stands": _exists("map/maps/**/map.npz"),
    "encode, a clip without its ledger line": _exists("encode/clips/**/*.clip"),
    "pack, in the middle of a shard": _exists("pack/release/*"),
    "pack, shards stand without a manifest": _has_lines("pack", 1),
}
"""What real stages may leave behind; that a run may die at any step is shown with small stages in tests/faults."""


def _words(source: Path, run: Path, workers: int) -> list[str]:
    recipe = run.with_name("recipe.toml")
    recipe.write_text(RECIPE)
    return ["run", str(recipe), "--set", f"source={source}", "--out", str(run), "--workers", str(workers), "-q"]


def _start(source: Path, run: Path, workers: int) -> subprocess.Popen[bytes]:
    """A run in a group of processes of its own, which can be killed."""
    command = [*WSM, *_words(source, run, workers)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


def _finish(source: Path, run: Path, workers: int) -> None:
    app(_words(source, run, workers), standalone_mode=False)


@pytest.fixture(scope="module")
def undisturbed(make_source, file_digests, tmp_path_factory):
    run = tmp_path_factory.mktemp("undisturbed") / "run"
    _finish(make_source(), run, workers=1)
    return file_digests(run / "pack" / "release")


def _kill_when(process: subprocess.Popen[bytes], run: Path, reached) -> bool:
    """SIGKILL the process group once the condition holds; False when it ended first."""
    while process.poll() is None:
        if run.exists() and reached(run):
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return True
        time.sleep(0.002)
    process.communicate()
    return False


@pytest.mark.parametrize("point", KILL_POINTS)
def test_a_run_that_was_killed_ends_in_the_bytes_of_an_undisturbed_one(
    point, undisturbed, make_source, file_digests, tmp_path
):
    run = tmp_path / "run"
    killed = _kill_when(_start(make_source(), run, workers=1), run, KILL_POINTS[point])
    assert killed, "the run ended before it could be killed; the condition names nothing that exists"
    _finish(make_source(), run, workers=1)
    assert file_digests(run / "pack" / "release") == undisturbed
    for stage in ("index", "encode", "pack"):
        units = ledger(run / stage)
        assert len(units) == len(set(units)), f"{stage} settled a unit twice"


def test_a_run_killed_again_and_again_still_ends_in_the_same_bytes(undisturbed, make_source, file_digests, tmp_path):
    run = tmp_path / "run"
    for lines in (1, 2, 3):
        process = _start(make_source(), run, workers=2)
        assert _kill_when(process, run, _has_lines("encode", lines)), f"nothing was killed at {lines} clips"
    _finish(make_source(), run, workers=2)
    assert file_digests(run / "pack" / "release") == undisturbed
