from dataclasses import fields, replace

import numpy as np
import pytest

from pipelines.artifacts.episode_table import (
    EPISODES_FILE,
    EpisodeRow,
    read_episodes,
    record_digest,
    row_from_json,
    row_json,
    write_episodes,
)
from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import read_lines, write_lines
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

RECORD = EpisodeRecord(
    id=EpisodeId.parse("box_zed/hall/000000"),
    container="box_zed/hall.tar.gz",
    rgb_members=("0.jpg", "1.jpg"),
    depth_members=("0.png", "1.png"),
    T_world_camera=np.stack([np.eye(4), np.eye(4)]),
    intrinsics=Intrinsics(fx=50.0, fy=51.0, cx=32.0, cy=16.0, width=64, height=32),
    camera_height_m=0.5,
    camera_pitch_rad=0.1,
    frames_digest="frames",
    content_digest="content",
)


def row(text, **changes):
    values = {"container": "box_zed/hall", "digest": "d", "record_digest": "r", "frames": 7, "floor_z_m": 0.1 + 0.2}
    return EpisodeRow(id=EpisodeId.parse(text), **{**values, **changes})


def test_rows_come_back_as_they_were_to_the_last_bit_sorted_by_id(tmp_path):
    rows = [row("box_zed/hall/000002"), row("box_d435i/hall/000001", digest="e"), row("box_zed/a b.c/000001")]
    write_episodes(tmp_path, rows)
    assert read_episodes(tmp_path) == sorted(rows, key=lambda one: one.id)


def test_ids_are_sorted_by_their_parts_and_not_as_text(tmp_path):
    """`-` sorts before `/`: as text `a-b/...` would stand between the scenes of `a`."""
    rows = [row("a/x/1"), row("a-b/x/1"), row("a/y/1")]
    write_episodes(tmp_path, rows)
    assert [one.id.text for one in read_episodes(tmp_path)] == ["a/x/1", "a/y/1", "a-b/x/1"]


def test_a_row_is_the_same_in_the_table_and_as_json(tmp_path):
    write_episodes(tmp_path, [row("box_zed/hall/000002")])
    (line,) = read_lines(tmp_path / EPISODES_FILE)
    assert row_from_json(line) == row("box_zed/hall/000002")


@pytest.mark.parametrize("change", [{"frames": "7"}, {"id": "hall"}, {"floor_z_m": None}, {"colour": 1}])
def test_a_line_that_is_no_row_is_damage(tmp_path, change):
    write_lines(tmp_path / EPISODES_FILE, [{**row_json(row("box_zed/hall/000002")), **change}])
    with pytest.raises(IntegrityError, match=r"must hold a trajectory a line, but: .*; run `wsm index` again"):
        read_episodes(tmp_path)


def test_a_source_without_a_usable_trajectory_has_an_empty_table(tmp_path):
    write_episodes(tmp_path, [])
    assert read_episodes(tmp_path) == []


def test_a_table_that_is_gone_is_not_taken_for_an_empty_one(tmp_path):
    with pytest.raises(IntegrityError, match=r"episodes\.jsonl is missing; run `wsm index` again"):
        read_episodes(tmp_path)


def test_whatever_the_reader_made_of_a_trajectory_is_in_its_digest_and_where_its_files_lie_is_not():
    one_step_up = RECORD.T_world_camera.copy()
    one_step_up[1, 2, 3] = np.nextafter(0, 1)
    stated = {
        "T_world_camera": one_step_up,
        "intrinsics": replace(RECORD.intrinsics, cx=31.5),
        "camera_height_m": 0.51,
        "camera_pitch_rad": 0.11,
        "frames_digest": "others",
        "content_digest": "another",
        "notes": ("episode.length_mismatch",),
        "goal_world_m": (1.0, 2.0, 0.5),
    }
    places = {"container": "box_zed/hall", "rgb_members": ("a", "b"), "depth_members": ("c", "d")}
    assert {*stated, *places, "id"} == {field.name for field in fields(EpisodeRecord)}
    digests = {record_digest(replace(RECORD, **{name: value})) for name, value in stated.items()}
    assert len(digests | {record_digest(RECORD)}) == len(stated) + 1
    assert record_digest(replace(RECORD, **places)) == record_digest(RECORD)
