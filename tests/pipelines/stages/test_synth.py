"""What `wsm synth` leaves: the source tree, and each home once as a model beside it."""

import pytest
import trimesh

from pipelines.registry import load_stage
from pipelines.running.ledger import read_ledger
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.readers.interndata.containers import find_containers
from wsm_data.readers.manifest import load_dataset
from wsm_data.synth.config import SynthConfig

SMALL = SynthConfig(
    scenes=2, trajectories=1, image_scale=0.25, min_frames=8, max_frames=40, min_step_m=0.1, max_step_m=0.4
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("synth")
    run_stage(load_stage("synth"), SMALL, out, RunOptions(workers=1, quiet=True))
    return out


def test_the_tree_is_a_source_with_every_scene_under_every_camera(made):
    containers = find_containers(made / "tree", load_dataset("synthetic"))
    assert sorted(one.id for one in containers) == [
        f"synth_{camera}/home_000{scene}.tar.gz" for camera in ("d435i", "zed") for scene in (1, 2)
    ]


def test_each_home_is_one_model_outside_the_source(made):
    assert sorted(path.name for path in made.rglob("*.glb")) == ["home_0001.glb", "home_0002.glb"]
    sizes = [trimesh.load_scene(made / "homes" / f"home_000{scene}.glb").extents for scene in (1, 2)]
    assert all(2.0 < up < 4.0 and min(x, z) > 3.0 for x, up, z in sizes)
    assert sizes[0].tolist() != sizes[1].tolist()


def test_outputs_in_the_ledger_are_all_that_was_written(made):
    named = sorted(name for entry in read_ledger(made).values() for name in entry.outcome.outputs)
    written = [path for folder in ("tree", "homes") for path in (made / folder).rglob("*") if path.is_file()]
    assert named == sorted(path.relative_to(made).as_posix() for path in written)


def test_a_model_that_was_deleted_is_made_again_in_the_same_bytes(made):
    model = made / "homes" / "home_0002.glb"
    before = model.read_bytes()
    model.unlink()
    report = run_stage(load_stage("synth"), SMALL, made, RunOptions(workers=1, quiet=True))
    assert report.ran == ("d435i/0001",)
    assert model.read_bytes() == before
