"""`wsm inspect`: what it prints and draws of a small release."""

import json
from pathlib import Path

import cv2
import pytest
from box_room import MANIFEST_TOML, along_x, scene_files, write_folder

from pipelines.cli import app
from pipelines.operations.inspect import inspect_release, print_json
from pipelines.recipe import Recipe, stage_config
from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError, IntegrityError

SCENE = "box_zed/Acker.ville"
KEYS = ["box_zed/Acker%2Eville/000000", "box_zed/Acker%2Eville/000001", "box_zed/Acker%2Eville/000002"]


@pytest.fixture(scope="module")
def release(tmp_path_factory):
    """Three clips of a scene whose name has a dot, and one refusal."""
    root = tmp_path_factory.mktemp("inspected")
    drives = {number: along_x(y_m=0.7 + 0.1 * number, frames=5) for number in range(3)}
    write_folder(root / "source" / SCENE, scene_files({**drives, 3: along_x(frames=4)}))
    (root / "rooms.toml").write_text(MANIFEST_TOML)
    settings = {
        "index": {"dataset": str(root / "rooms.toml")},
        "split": {"test_fraction": 0.0},
        "encode": {"clip": {"width": 64, "height": 32}},
    }
    stages = ("index", "split", "map", "encode", "pack")
    recipe = Recipe(stages=stages, settings=settings, source=str(root / "source"))
    for name in stages:
        config = stage_config(recipe, name, root / "run")
        run_stage(load_stage(name), config, root / "run" / name, RunOptions(quiet=True, max_refused=1000))
    return root / "run" / "pack" / "release"


def inspect(release, key=None, out=None, rerun=None, limit=20, weights=""):
    inspect_release(str(release), key, out, rerun, limit, weights)


def test_a_release_is_verified_without_a_record_and_what_would_be_ignored_is_refused(release, capsys):
    app(["verify", str(release), "--quiet"], standalone_mode=False)
    assert capsys.readouterr().out == f"{release} is whole: 3 clips, every byte and every trajectory accounted for\n"
    with pytest.raises(SystemExit) as stopped:
        app(["verify", str(release), "--set", "x=1", "--limit", "2", "--dry-run"])
    assert stopped.value.code == 2
    assert "so --limit, --dry-run, --set would do nothing" in capsys.readouterr().err


def test_a_report_of_a_release_says_where_it_is(release, capsys, tmp_path):
    app(["report", str(release), "--quiet", "-w", "1", "-o", str(tmp_path / "page")], standalone_mode=False)
    assert capsys.readouterr().out.splitlines()[-1] == f"report: {tmp_path / 'page' / 'report.html'}"


def test_a_release_is_listed_with_its_clips_and_what_was_dropped(release, capsys):
    inspect(release)
    printed = capsys.readouterr().out
    assert "train-000000.tar" in printed
    assert "episode.too_short" in printed
    assert [line.strip() for line in printed.splitlines()][-3:] == KEYS


@pytest.mark.parametrize(
    ("limit", "shown", "rest"), [(2, 2, "and 1 more; --limit 0 lists all"), (3, 3, ""), (0, 3, "")]
)
def test_as_many_clips_are_listed_as_asked_for_and_the_rest_counted(release, capsys, limit, shown, rest):
    inspect(release, limit=limit)
    listed = capsys.readouterr().out.partition("\nclips\n")[2]
    assert [line.strip() for line in listed.splitlines()] == [*KEYS[:shown], *([rest] if rest else [])]


@pytest.mark.parametrize("name", [KEYS[1], f"{SCENE}/000001"])
def test_a_clip_is_found_by_its_key_and_by_the_id_of_its_trajectory(release, capsys, tmp_path, name):
    inspect(release, key=name, out=tmp_path / "sheet.png")
    printed = capsys.readouterr().out
    assert printed.startswith(KEYS[1])
    for word in ("rgb_latent", "float16", "geodesic_mm", "provenance", "source_digest"):
        assert word in printed
    assert printed.splitlines()[-1] == f"contact sheet: {tmp_path / 'sheet.png'}"
    assert cv2.imread(str(tmp_path / "sheet.png")).shape[1] == 1600


@pytest.mark.parametrize("name", [KEYS[1], f"{SCENE}/000001"])
def test_a_film_of_a_clip_is_written_where_it_is_asked_for(release, capsys, tmp_path, name):
    path = tmp_path / "clip.mp4"
    app(["film", str(release), name, "--out", str(path)], standalone_mode=False)
    assert capsys.readouterr().out == f"film: {path}, 5 frames\n"
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT) == 5


def test_a_film_that_would_be_no_mp4_is_a_wrong_request(release, capsys, tmp_path):
    with pytest.raises(SystemExit) as stopped:
        app(["film", str(release), KEYS[0], "--out", str(tmp_path / "clip.avi")])
    assert stopped.value.code == 2
    assert "ends in .mp4" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_as_many_clips_are_exported_as_asked_for_each_in_a_folder_of_its_own(release, capsys, tmp_path):
    app(["export", "tum", str(release), "--split", "train", "--limit", "2", "-o", str(tmp_path)], standalone_mode=False)
    assert capsys.readouterr().out == f"2 of 3 clips: {tmp_path}\n"
    first = open_release(release).keys(split="train")[:2]
    folders = [path for path in tmp_path.iterdir() if path.is_dir()]
    assert {path.name for path in folders} == {key.replace("/", ".") for key in first}
    assert all(len((path / "groundtruth.txt").read_text().splitlines()) == 5 for path in folders)


def test_without_a_name_the_sheet_is_called_after_its_clip(release, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    inspect(release, key=KEYS[0])
    assert [path.name for path in tmp_path.iterdir()] == ["box_zed_Acker%2Eville_000000.png"]


@pytest.mark.parametrize("name", ["box_zed/Acker.ville/000009", "nothing", "a/b", "a//b", "a/../b", "/a/b", "a/b/c/d"])
def test_a_clip_that_is_not_there_is_a_wrong_request(release, tmp_path, name):
    with pytest.raises(ConfigError, match=r"the release has no clip .*`wsm inspect RELEASE` lists what it has"):
        inspect(release, key=name, out=tmp_path / "sheet.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--out", "--rerun"])
def test_a_picture_or_a_recording_of_no_clip_is_a_wrong_request(option, tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        app(["inspect", str(tmp_path), option, str(tmp_path / "file")])
    assert stopped.value.code == 2
    assert "name it by its KEY" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("sheet", [None, "sheet.png"])
def test_a_recording_takes_the_place_of_the_sheet_unless_both_are_asked_for(
    release, capsys, tmp_path, monkeypatch, sheet
):
    monkeypatch.setattr(
        "pipelines.operations.inspect.write_rerun", lambda clip, codec, path: path.write_bytes(b"recording")
    )
    monkeypatch.chdir(tmp_path)
    inspect(release, key=KEYS[0], out=sheet and tmp_path / sheet, rerun=tmp_path / "clip.rrd")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.rrd", *([sheet] if sheet else [])]
    printed = capsys.readouterr().out
    assert f"recording: {tmp_path / 'clip.rrd'}" in printed
    assert ("contact sheet:" in printed) == bool(sheet)


def test_weights_that_do_not_belong_to_the_codec_are_refused(release, tmp_path):
    with pytest.raises(ConfigError, match="codec dct has no weights"):
        inspect(release, key=KEYS[0], out=tmp_path / "sheet.png", weights="somewhere")


def test_a_release_that_is_not_there_or_unfinished_is_named(release, tmp_path):
    with pytest.raises(ConfigError, match="there is no release at"):
        inspect(tmp_path / "absent")
    for above in (release.parent, release.parent.parent):
        with pytest.raises(ConfigError, match=rf"is no release, but holds one: give {release}$"):
            inspect(above)
    (tmp_path / "begun").mkdir()
    with pytest.raises(IntegrityError, match="unfinished"):
        inspect(tmp_path / "begun")


def test_json_says_of_a_release_and_of_a_clip_what_the_files_say(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "wsm_data" / "fakes"))
    from walled_release import UNITS, build_release

    release = build_release(tmp_path, UNITS)
    print_json(release.store.root, None, 2)
    said = json.loads(capsys.readouterr().out)
    stored = json.loads((tmp_path / "release" / "dataset.json").read_text())
    assert said["manifest"] | {"content_sha256": stored["content_sha256"]} == stored
    assert said["manifest"]["clips"] == len(UNITS)
    assert said["clips"] == sorted(release.keys())[:2]
    print_json(release.store.root, said["clips"][0], 0)
    clip = json.loads(capsys.readouterr().out)
    assert clip["meta"]["key"] == said["clips"][0]
    assert clip["shapes"]["poses"] == [clip["meta"]["frames"], 7]
