from collections.abc import Callable
from dataclasses import replace

import pytest

from wsm_data.errors import IntegrityError
from wsm_data.schema.clip import DEPTH_MEMBERS, Clip
from wsm_data.shards.fragment import build_fragment
from wsm_data.shards.index.row import SCHEMA, IndexRow, index_row, parse_row, row_record
from wsm_data.shards.members import MEMBER_NAMES


@pytest.fixture
def row(make_clip: Callable[..., Clip]) -> IndexRow:
    info = build_fragment(make_clip(padded_frames=3)).info
    return index_row(info, split="train", shard="train-000004.tar", position=2, clip_offset=1536)


def test_a_row_says_what_the_clip_is(row: IndexRow) -> None:
    assert (row.key, row.unit) == ("synth_d435i/home_0001/000003",) * 2
    assert (row.group, row.scene, row.episode) == ("synth_d435i", "home_0001", "000003")
    assert (row.physical_scene, row.camera, row.dataset) == ("synth/home_0001", "d435i", "synthetic")
    assert (row.latents, row.frames, row.padded_frames, row.codec_digest) == (3, 9, 3, "c0dec")


def test_stored_offsets_count_from_the_start_of_the_shard(row: IndexRow) -> None:
    record = row_record(row)
    assert record["rgb_latent_offset"] == 1536 + 512 + 128  # tar header and npy header before the array
    assert record["meta_offset"] + record["meta_size"] <= 1536 + row.clip_size
    assert [record[f"{member.name}_offset"] for member in row.members] == [
        1536 + member.array_offset for member in row.members
    ]


def test_a_row_survives_its_columns(row: IndexRow) -> None:
    record = row_record(row)
    assert set(record) == set(SCHEMA.names)
    assert parse_row(record) == row


def test_the_largest_checksum_fits(row: IndexRow) -> None:
    largest = replace(row, members=tuple(replace(member, checksum="f" * 16) for member in row.members))
    assert parse_row(row_record(largest)) == largest


@pytest.mark.parametrize(
    ("column", "value"),
    [("poses_offset", 64), ("poses_size", 1), ("clip_size", 512), ("frames", 13), ("latents", -1), ("meta_size", None)],
)
def test_a_row_that_contradicts_itself_is_refused(row: IndexRow, column: str, value: object) -> None:
    with pytest.raises(IntegrityError, match=r"train-000004\.tar, clip synth_d435i/home_0001/000003: its row"):
        parse_row(row_record(row) | {column: value})


def test_the_documentation_lists_every_column(words_of_table: Callable[[str], list[str]]) -> None:
    listed: list[str] = []
    for word in words_of_table("## index.parquet"):
        listed += [word.replace("<member>", name) for name in MEMBER_NAMES] if "<member>" in word else [word]
    assert sorted(listed) == sorted(SCHEMA.names)


def test_members_that_a_clip_does_not_have_are_zeros_and_come_back_absent(make_clip: Callable[..., Clip]) -> None:
    info = build_fragment(replace(make_clip(), depth_latent=None, depth_valid=None)).info
    row = index_row(info, split="train", shard="train-000000.tar", position=0, clip_offset=512)
    record = row_record(row)
    absent = [record[f"{name}_{what}"] for name in DEPTH_MEMBERS for what in ("offset", "size", "checksum")]
    assert absent == [0] * 6
    assert parse_row(record) == row
    with pytest.raises(IntegrityError, match="restore the index"):
        parse_row({**record, "depth_latent_offset": 512})
