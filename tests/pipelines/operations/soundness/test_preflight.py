import json
import shutil

import numpy as np
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.readers.arrays import write_episode

POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"


def preflight(*words, dataset="synthetic"):
    runner = CliRunner(env={"GITHUB_ACTIONS": ""})
    return runner.invoke(app, ["preflight", *map(str, words), "--dataset", dataset, "--workers", "1", "--quiet"])


def test_what_to_fetch_again_is_listed_and_a_whole_source_has_nothing(make_source, tmp_path):
    source = shutil.copytree(make_source(), tmp_path / "source")
    again = tmp_path / "again.txt"
    done = preflight(source, "--refetch", again)
    assert (done.exit_code, again.read_text()) == (0, ""), done.output
    first, second = sorted(source.rglob("*.tar.gz"))
    first.write_bytes(POINTER)
    second.write_bytes(second.read_bytes()[:5000])
    done = preflight(source, "--refetch", again, "--json")
    assert done.exit_code == 3, done.output
    assert again.read_text().split() == [path.relative_to(source).as_posix() for path in (first, second)]
    said = json.loads(done.stdout)
    assert [one["reason"] for one in said["findings"]] == ["archive.pointer_file", "archive.truncated"]
    assert [one["walked"] for one in said["units"]] == [True, True]


def test_of_what_is_not_sampled_only_the_ends_are_read(make_source):
    done = preflight(make_source(), "--sample", 0, "--json")
    assert done.exit_code == 0, done.output
    assert [one["bytes_read"] for one in json.loads(done.stdout)["units"]] == [0, 0]


def test_a_share_that_is_none_is_a_wrong_request(make_source):
    assert preflight(make_source(), "--sample", 2).exit_code == 2


def test_a_floor_that_the_first_image_does_not_show_is_found_in_those_that_a_run_samples(tmp_path):
    """A wall 2 m ahead, then a floor 1 m below a camera that looks down by 45 degrees: depth 1 / (sin 45 (1 + y))."""
    s = np.sqrt(0.5)
    y = (np.arange(96) - 47.5) / 96
    floor_m = np.repeat(1 / (s * (1 + y))[:, None], 128, axis=1).astype(np.float32)

    def frames():
        for i in range(10):
            T = np.array([[1.0, 0, 0, 0], [0, -s, s, 0.1 * i], [0, -s, -s, 1], [0, 0, 0, 1]])
            level = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1]])
            depth_m, pose = (floor_m, T) if i else (np.full((96, 128), 2, np.float32), level)
            yield np.zeros((96, 128, 3), np.uint8), depth_m, pose

    K = np.array([[96.0, 0, 63.5], [0, 96.0, 47.5], [0, 0, 1]])
    write_episode(tmp_path / "source", "floor", "one", frames(), K=K)
    done = preflight(tmp_path / "source", dataset="arrays")
    assert done.exit_code == 0, done.output
