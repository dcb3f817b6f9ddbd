"""Every damage that `wsm verify` knows, under the training reader: detected, and named by shard and clip."""

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.access.release import open_release
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.loaders.config import OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.order.epoch_order import EpochOrder
from wsm_data.loaders.reading.clip_places import READ_MEMBERS
from wsm_data.loaders.reading.prefetch import done_alone
from wsm_data.loaders.reading.step_reader import StepReader
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.timing import Timing
from wsm_data.shards.index.row import IndexRow, row_record
from wsm_data.shards.index.table import write_index
from wsm_data.shards.manifest import manifest_bytes

Damage = Callable[[Path, IndexRow], None]


@pytest.fixture
def folder(released, tmp_path) -> Path:
    return released.copied(tmp_path / "release")


@pytest.fixture
def victim(released) -> IndexRow:
    """The last clip of a shard with several: what is cut off the shard hits it alone."""
    rows = [released.release.index.row_at(number) for number in range(len(released.clips))]
    return next(row for row, after in pairwise(rows) if row.position >= 3 and after.position == 0)


def _read_all(folder: Path, **settings: object) -> dict[str, str]:
    """Reads every clip in a step of its own; returns the messages of those that were refused, by key."""
    sources = open_sources([SourceConfig(release=str(folder))])
    epoch_order: EpochOrder = sources.order_epoch(OrderConfig(global_batch=1, shuffle=False), 0)
    reader = StepReader(sources, ReadConfig(**settings), Timing(), rank=0, world_size=1)
    refused: dict[str, str] = {}
    for step in range(epoch_order.steps):
        try:
            done_alone(reader.begin(epoch_order, step, lambda block: block))
        except IntegrityError as error:
            refused[sources.keys(epoch_order.rows(step, 0, 1)[0])[0]] = str(error)
    reader.close()
    return refused


def _cut(size: int) -> Damage:
    return lambda folder, row: os.truncate(folder / row.shard, row.clip_offset + size)


def _cut_in(member: int, part: str) -> Damage:
    def damage(folder: Path, row: IndexRow) -> None:
        item = row.members[member]
        inside = {"boundary": item.header_offset, "header": item.header_offset + 100, "payload": item.array_offset + 9}
        os.truncate(folder / row.shard, row.clip_offset + inside[part])

    return damage


def _flip(member: int, part: str) -> Damage:
    def damage(folder: Path, row: IndexRow) -> None:
        item = row.members[member]
        places = {
            "tar header": item.header_offset + 20,
            "npy header": item.array_offset - 60,
            "first byte": item.array_offset,
            "last byte": item.array_offset + item.array_size - 1,
            "padding": item.data_offset + item.data_size,
        }
        path, place = folder / row.shard, row.clip_offset + places[part]
        data = bytearray(path.read_bytes())
        data[place] ^= 0x10
        path.write_bytes(data)

    return damage


CUTS = {
    "at the sample's boundary": _cut(0),
    **{f"at the boundary of {name}": _cut_in(number, "boundary") for number, name in enumerate(READ_MEMBERS)},
    **{f"inside the header of {name}": _cut_in(number, "header") for number, name in enumerate(READ_MEMBERS)},
    **{f"inside {name}": _cut_in(number, "payload") for number, name in enumerate(READ_MEMBERS)},
}
CHANGES = {
    f"{part} of {name}": _flip(number, part)
    for number, name in enumerate(READ_MEMBERS)
    for part in ("tar header", "npy header", "first byte", "last byte")
} | {"padding of poses": _flip(2, "padding")}


@pytest.mark.parametrize("verify", ["first", "never"])
@pytest.mark.parametrize("damage", CUTS.values(), ids=CUTS)
def test_a_cut_shard_is_named_with_the_clip_it_ends_in(folder, victim, damage, verify):
    damage(folder, victim)
    refused = _read_all(folder, verify=verify)
    assert set(refused) == {victim.key}
    assert f"clip {victim.key}" in refused[victim.key]
    assert victim.shard in refused[victim.key]
    assert "fetch it again" in refused[victim.key]


@pytest.mark.parametrize("verify", ["first", "always"])
@pytest.mark.parametrize("damage", CHANGES.values(), ids=CHANGES)
def test_a_changed_byte_is_named_with_shard_clip_and_member(folder, victim, damage, verify):
    damage(folder, victim)
    refused = _read_all(folder, verify=verify)
    assert set(refused) == {victim.key}
    assert refused[victim.key].startswith(f"{victim.shard}, clip {victim.key}: the ")
    assert ".npy" in refused[victim.key]


@pytest.mark.parametrize("max_latents", [1, 3])
@pytest.mark.parametrize("damage", [_flip(0, "last byte"), _flip(1, "last byte"), _flip(3, "last byte")])
def test_a_prefix_vouches_for_the_whole_member_the_first_time(folder, victim, damage, max_latents):
    damage(folder, victim)
    sources = open_sources([SourceConfig(release=str(folder))])
    epoch_order = sources.order_epoch(OrderConfig(global_batch=1, shuffle=False, max_latents=max_latents), 0)
    reader = StepReader(sources, ReadConfig(verify="first"), Timing(), rank=0, world_size=1)
    step = sources.keys(range(sources.clips)).index(victim.key)
    with pytest.raises(IntegrityError, match=f"clip {victim.key}: the checksum"):
        done_alone(reader.begin(epoch_order, step, lambda block: block))


def test_damage_that_is_read_again_is_refused_again(folder, victim):
    """A clip counts as checked only when it was found whole."""
    _flip(0, "first byte")(folder, victim)
    sources = open_sources([SourceConfig(release=str(folder))])
    epoch_order = sources.order_epoch(OrderConfig(global_batch=1, shuffle=False), 0)
    reader = StepReader(sources, ReadConfig(verify="first"), Timing(), rank=0, world_size=1)
    step = sources.keys(range(sources.clips)).index(victim.key)
    for _ in range(2):
        with pytest.raises(IntegrityError, match="checksum"):
            done_alone(reader.begin(epoch_order, step, lambda block: block))


def test_a_missing_shard_is_named_with_each_of_its_clips(folder, victim, released):
    (folder / victim.shard).unlink()
    refused = _read_all(folder)
    lost = {row.key for row in released.release.index.rows_of_shard(victim.shard)}
    assert set(refused) == lost
    assert all(f"{victim.shard} is missing from" in refused[key] and key in refused[key] for key in lost)


def _change_index(folder: Path, key: str, change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Changes the row of a clip, and makes the manifest vouch for the index that it finds."""
    release, path = open_release(folder), folder / "index.parquet"
    table = pq.read_table(path)
    records = [change(record) if record["key"] == key else record for record in table.to_pylist()]
    write_index(path, pa.Table.from_pylist(records, schema=table.schema))
    manifest = replace(release.manifest, index_sha256=sha256_file(path))
    (folder / "dataset.json").write_bytes(manifest_bytes(manifest))


def _moved(count: int) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda record: {name: value + count if name.endswith("_offset") else value for name, value in record.items()}


@pytest.mark.parametrize("blocks", [-4, -1, 1])
def test_a_clip_that_does_not_stand_where_the_index_says_is_named(folder, victim, blocks):
    _change_index(folder, victim.key, _moved(512 * blocks))
    refused = _read_all(folder)
    assert set(refused) == {victim.key}
    assert refused[victim.key].startswith(f"{victim.shard}, clip {victim.key}: ")


def test_a_clip_under_the_name_of_another_is_named(folder, victim, released):
    """Two rows with each other's places: sizes fit, and the headers in the shard tell them apart."""
    index = released.release.index
    twin = next(
        row
        for row in (index.row_at(number) for number in range(len(released.clips)))
        if row.shard == victim.shard and row.key != victim.key and row.latents == victim.latents
    )
    places = {
        row.key: {name: value for name, value in row_record(row).items() if "offset" in name} for row in (victim, twin)
    }
    _change_index(folder, victim.key, lambda record: record | places[twin.key])
    refused = _read_all(folder)
    assert set(refused) == {victim.key}
    assert "header of rgb_latent.npy" in refused[victim.key]


@pytest.mark.parametrize(
    "change",
    [
        {"latents": 3},
        {"rgb_latent_size": 77},
        {"depth_latent_offset": 0},
        {"poses_offset": 1 << 40},
        {"clip_offset": 0},
    ],
    ids=str,
)
@pytest.mark.parametrize("verify", ["first", "never"])
def test_a_row_that_contradicts_itself_is_named_before_anything_is_read(folder, victim, change, verify):
    _change_index(folder, victim.key, lambda record: record | change)
    refused = _read_all(folder, verify=verify)
    assert set(refused) == {victim.key}
    assert "index.parquet places members where a clip of" in refused[victim.key]
    assert refused[victim.key].startswith(f"{victim.shard}, clip {victim.key}: ")
