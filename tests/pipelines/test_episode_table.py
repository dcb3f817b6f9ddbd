import pytest

from pipelines.episode_table import EPISODES_FILE, EpisodeRow, read_episodes, row_from_json, write_episodes
from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import read_lines
from wsm_data.schema.identity import EpisodeId


def row(text, **changes):
    values = {"container": "box_zed/hall", "digest": "d", "frames": 7, "floor_z_m": 0.1 + 0.2, "notes": ("a.b", "c.d")}
    return EpisodeRow(id=EpisodeId.parse(text), **{**values, **changes})


def test_rows_come_back_as_they_were_to_the_last_bit_sorted_by_id(tmp_path):
    rows = [row("box_zed/hall/000002"), row("box_d435i/hall/000001", notes=()), row("box_zed/a b.c/000001")]
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


def test_a_source_without_a_usable_trajectory_has_an_empty_table(tmp_path):
    write_episodes(tmp_path, [])
    assert read_episodes(tmp_path) == []


def test_a_table_that_is_gone_is_not_taken_for_an_empty_one(tmp_path):
    with pytest.raises(IntegrityError, match=r"episodes\.jsonl is missing; run `wsm index` again"):
        read_episodes(tmp_path)
