"""All checks on a container of generated homes, against what a run of the stages decides."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from wsm_data.clips import soundness
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.soundness import SourceChecks, check_container
from wsm_data.errors import Reason
from wsm_data.readers.guard import guarded
from wsm_data.readers.manifest import load_dataset
from wsm_data.readers.registry import source_reader

CLIP = ClipConfig(width=96, height=64)


@pytest.fixture
def source(make_source, tmp_path):
    """A copy of a scene in folders, whose files may be changed."""
    return Path(shutil.copytree(make_source(cameras=("d435i",), layout="scene_folder"), tmp_path / "source"))


def checked(source):
    dataset = load_dataset("synthetic")
    checks = SourceChecks(source=source, dataset=dataset, clip=CLIP, depth_sample_every=2)
    (container,) = source_reader(dataset).find_containers(source, dataset)
    return {one.unit: one for one in check_container(container, checks)}


def test_sound_trajectories_have_a_verdict_of_every_check_with_numbers_and_limits(source):
    units = checked(source)
    assert len(units) == 2
    for unit in units.values():
        assert unit.findings == ()
        assert list(unit.verdicts) == [
            *("length", "intrinsics_fit", "mount", "pose_jump"),
            *("frames_repeat", "frames_shown", "colour_order", "depth_share", "depth_steps", "depth_noise"),
            *("depth_agreement", "cloud_agreement", "cloud_alignment", "path_shown", "expert_path"),
            *("depth_motion", "colour_agreement", "depth_order", "time_offset", "floor_level"),
            *("reachability", "goal_reached"),
        ]
        assert all(verdict.measured for verdict in unit.verdicts.values())
        assert unit.frames >= 10
        assert len(unit.digest) == 64


def test_a_frame_that_does_not_decode_is_found_wherever_it_is(source):
    frame = sorted(source.rglob("*.jpg"))[1]  # no check samples it, a clip needs it
    frame.write_bytes(frame.read_bytes()[:200])
    found = [finding for unit in checked(source).values() for finding in unit.findings]
    assert [finding.reason for finding in found] == [Reason.FRAME_TRUNCATED]
    assert found[0].details["check"] == "readable"


def test_a_damaged_cloud_is_a_finding_of_the_container_and_the_records_are_checked_still(source):
    cloud = next(source.rglob("*.ply"))
    cloud.write_bytes(cloud.read_bytes()[:-100])
    units = checked(source)
    assert sorted(len(unit.findings) for unit in units.values()) == [0, 0, 1]
    assert [list(unit.verdicts) for unit in units.values()].count(
        ["length", "intrinsics_fit", "mount", "pose_jump"]
    ) == 2


def test_a_container_that_cannot_be_read_is_one_finding(tmp_path):
    (tmp_path / "group_d435i").mkdir()
    (tmp_path / "group_d435i" / "home.tar.gz").write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
    (unit,) = checked(tmp_path).values()
    assert [finding.reason for finding in unit.findings] == [Reason.ARCHIVE_POINTER_FILE]


def test_a_container_that_a_parser_fails_on_in_the_second_pass_is_one_finding(source, monkeypatch):
    def fails(*_):
        raise MemoryError

    failing = guarded(replace(source_reader(load_dataset("synthetic")), iter_frames=fails))
    monkeypatch.setattr(soundness, "source_reader", lambda _: failing)
    (unit,) = checked(source).values()
    assert [finding.reason for finding in unit.findings] == [Reason.CONTAINER_UNPARSABLE]
