"""Hostile inputs, each indexed by a process of 6 GB beside a sound container, which is read as if it stood alone."""

import json
from pathlib import Path

import pytest
from box_room import MANIFEST_TOML, along_x, scene_files, write_folder
from hostile.archives import ARCHIVES
from hostile.process import limited
from hostile.recordings import EPISODES, SEQUENCES, write_arrays, write_sequence
from hostile.scenes import SCENES

from pipelines.running.ledger import read_ledger

MANIFESTS = Path(__file__).parents[2] / "manifests/datasets"
FAST = {
    "a pipe as colour image", "a time stamp as frame number", "a colour image of 8 GiB of zeros in a tar",
    "tum: a position of infinity", "arrays: nested 100,000 deep",
}  # fmt: skip
SOUND = along_x(y_m=0.8, frames=8, step_m=0.2)


def _write_scene(folder):
    write_folder(folder, scene_files({0: SOUND}))


KINDS = (
    ("interndata", "box_d435i/good", _write_scene, (*SCENES, *ARCHIVES)),
    ("tum_rgbd", "good", lambda folder: write_sequence(folder, SOUND), SEQUENCES),
    ("arrays", "good", lambda folder: write_arrays(folder, SOUND), EPISODES),
)
"""Manifest, name of the sound container, what writes it, and the hostile inputs."""

INPUTS = [
    pytest.param(manifest, good, write, one, id=one.name, marks=[] if one.name in FAST else [pytest.mark.slow])
    for manifest, good, write, inputs in KINDS
    for one in inputs
]


def dataset_of(manifest, folder):
    """The manifest to read with: InternData's of the rooms, TUM's of a floor that is known."""
    path = folder / "dataset.toml"
    if manifest == "interndata":
        path.write_text(MANIFEST_TOML)
    elif manifest == "tum_rgbd":
        path.write_text((MANIFESTS / "tum_rgbd.toml").read_text().replace("[motion]", "[motion]\nfloor_z_m = 0.0"))
    return path if path.exists() else manifest


def became(folder, container):
    """Whether a trajectory of a container was kept, and the reasons for which it, or its cloud, was refused."""
    kept = any(row["container"] == container for row in lines_of(folder / "episodes.jsonl"))
    refused = {line["reason"] for line in lines_of(folder / "quarantine.jsonl") if line["source"] == container}
    clouds = [entry.outcome.facts.get("cloud_refusal") for entry in read_ledger(folder).values()]
    return kept, refused | {one["reason"] for one in clouds if one and one["source"] == container}


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.mark.parametrize(("manifest", "good", "write", "hostile"), INPUTS)
def test_a_hostile_input_is_refused_in_one_line_and_its_neighbour_is_read(
    manifest, good, write, hostile, tmp_path, faults
):
    source = tmp_path / "source"
    write(source / good)
    place = source / hostile.place
    place.parent.mkdir(parents=True, exist_ok=True)
    hostile.plant(place)
    options = ("--workers", "1", "--max-refused", "1000", "--quiet")
    inputs = ("--set", f"source={source}", "--set", f"dataset={dataset_of(manifest, tmp_path)}")
    code = limited(["index", "--out", str(tmp_path / "index"), *options, *inputs], tmp_path / "said.txt")
    said = (tmp_path / "said.txt").read_text(errors="surrogateescape")
    assert (code, "Traceback" in said) == (0, False), said[-2000:]
    kept, refused = became(tmp_path / "index", hostile.place)
    assert good in {row["container"] for row in lines_of(tmp_path / "index/episodes.jsonl")}
    if hostile.refused:
        assert [reason for reason in refused if reason.startswith(hostile.refused)], (refused, kept)
    else:
        assert (kept, refused) == (True, set())
    said += (tmp_path / "index/quarantine.jsonl").read_text()
    assert [one for one in said if not one.isprintable() and one != "\n"] == []
    faults["hostile inputs"] += 1
