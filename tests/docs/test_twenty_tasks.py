"""Twenty tasks that a person has with a release, each in five lines, run from the first to the last."""

import re
import runpy
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

sys.path.insert(0, str(Path(__file__).parents[1] / "wsm_data" / "fakes"))

from surveyed_selection import selected  # noqa: F401

SCRIPT = Path(__file__).parents[2] / "examples" / "twenty_tasks.py"


def test_there_are_twenty_tasks_of_five_lines_at_most():
    tasks = re.split(r"^# (\d+)\. .*\n", SCRIPT.read_text(), flags=re.MULTILINE)[1:]
    numbers, bodies = tasks[::2], tasks[1::2]
    assert list(map(int, numbers)) == list(range(1, 21))
    assert {
        number: body for number, body in zip(numbers, bodies, strict=True) if len(body.strip().splitlines()) > 5
    } == {}


@pytest.fixture(scope="module")
def done(selected, tmp_path_factory) -> dict[str, object]:  # noqa: F811
    out = tmp_path_factory.mktemp("out")
    before = sys.argv
    sys.argv = [str(SCRIPT), selected.release.store.root, str(out)]
    try:
        return runpy.run_path(str(SCRIPT))
    finally:
        sys.argv = before


def test_every_task_leaves_what_it_promises(done):
    out, release, clip = done["out"], done["release"], done["clip"]
    for name in ("difficulty.png", "map.png", "sheet.png"):
        assert cv2.imread(str(out / name)).std() > 0, name
    assert np.array_equal(cv2.imread(str(out / "frame.png"))[..., ::-1], release.decode(done["key"]).rgb[7])
    assert np.array_equal(np.load(out / "depth_m.npy"), release.decode(done["key"]).depth_m[7])
    assert len(list(out.glob("*.mp4"))) >= 1
    assert np.loadtxt(out / "path.csv", delimiter=",", skiprows=1).shape == (clip.meta.recorded_frames, 3)
    cloud = trimesh.load(out / "frame.ply")
    assert len(cloud.vertices) == done["seen"].measured.sum()
    assert cloud.vertices[:, 2].max() == pytest.approx(done["seen"].depth_m[done["seen"].measured].max(), rel=1e-6)
    assert (out / "tum/groundtruth.txt").exists()
    assert (out / "clip.tar").stat().st_size == release.index.row(done["key"]).clip_size + 1024
    assert done["net"].weight.isfinite().all()
    assert done["batch"].rgb.shape[0] == 2
    assert done["sample"]["__key__"] in release.index.texts("key")
