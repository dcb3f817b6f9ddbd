from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError
from wsm_data.files.digest import sha256_file
from wsm_data.schema.clip import Clip
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import index_table, write_index
from wsm_data.shards.manifest import manifest_bytes


def _kinds(folder: Path) -> list[tuple[str, str | None, str | None]]:
    return [(str(finding.kind), finding.shard, finding.clip) for finding in verify_release(folder)]


def test_a_sound_release_has_no_findings_and_its_progress_adds_up(tiny: SimpleNamespace) -> None:
    progress: list[int] = []
    assert verify_release(tiny.folder, progress.append) == []
    assert sum(progress) == sum(shard.bytes for shard in tiny.manifest.shards)


def test_no_folder_is_a_wrong_request(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no release"):
        verify_release(tmp_path / "nowhere")


def test_an_unfinished_release_is_found(tiny: SimpleNamespace) -> None:
    (tiny.folder / "dataset.json").unlink()
    assert _kinds(tiny.folder) == [("release.unreadable", None, None)]


def test_any_changed_byte_of_the_manifest_is_found(tiny: SimpleNamespace) -> None:
    path = tiny.folder / "dataset.json"
    data = path.read_bytes()
    for place in range(0, len(data), 31):
        damaged = bytearray(data)
        damaged[place] ^= 0x01
        path.write_bytes(damaged)
        assert _kinds(tiny.folder) == [("release.unreadable", None, None)], place


@pytest.mark.parametrize(
    ("name", "step"), [("index.parquet", 211), ("inventory.parquet", 53), ("quarantine.jsonl", 13)]
)
def test_any_changed_byte_beside_the_shards_is_found_and_named(tiny: SimpleNamespace, name: str, step: int) -> None:
    path = tiny.folder / name
    data = path.read_bytes()
    for place in range(0, len(data), step):
        damaged = bytearray(data)
        damaged[place] ^= 0x01
        path.write_bytes(damaged)
        first = verify_release(tiny.folder)[0]
        assert first.kind == "file.changed", place
        assert f"{name} must have sha256" in first.message


@pytest.mark.parametrize("name", ["index.parquet", "inventory.parquet", "quarantine.jsonl"])
def test_a_missing_file_beside_the_shards_is_found(tiny: SimpleNamespace, name: str) -> None:
    (tiny.folder / name).unlink()
    [finding] = verify_release(tiny.folder)
    assert finding.kind == "file.changed"
    assert f"{name} is missing" in finding.message


def test_a_missing_and_an_unlisted_shard_are_named(tiny: SimpleNamespace) -> None:
    (tiny.folder / "train-000001.tar").rename(tiny.folder / "train-000077.tar")
    assert _kinds(tiny.folder) == [
        ("shard.unlisted", "train-000077.tar", None),
        ("shard.missing", "train-000001.tar", None),
    ]


def test_damage_in_a_shard_is_named_with_shard_and_clip(tiny: SimpleNamespace) -> None:
    row = open_release(tiny.folder).index.row(tiny.clips[5].meta.key)
    path = tiny.folder / row.shard
    damaged = bytearray(path.read_bytes())
    damaged[row.clip_offset + row.members[0].array_offset + 11] ^= 1
    path.write_bytes(damaged)
    assert _kinds(tiny.folder) == [("clip.payload", row.shard, row.key), ("shard.changed", row.shard, None)]


def test_shards_exchanged_for_one_another_are_found(tiny: SimpleNamespace) -> None:
    one, two = tiny.folder / "train-000000.tar", tiny.folder / "train-000001.tar"
    first, second = one.read_bytes(), two.read_bytes()
    one.write_bytes(second)
    two.write_bytes(first)
    found = {(kind, shard) for kind, shard, _ in _kinds(tiny.folder)}
    assert {("shard.changed", "train-000000.tar"), ("shard.changed", "train-000001.tar")} <= found


def _publish(tiny: SimpleNamespace, drop: int) -> str:
    """Rewrite the index without one row, and a manifest that vouches for it; returns the dropped clip."""
    index = open_release(tiny.folder).index
    rows = [index.row_at(number) for number in range(len(index))]
    dropped = rows.pop(drop)
    write_index(tiny.folder / "index.parquet", index_table(rows))
    manifest = replace(tiny.manifest, index_sha256=sha256_file(tiny.folder / "index.parquet"))
    (tiny.folder / "dataset.json").write_bytes(manifest_bytes(manifest))
    return dropped.key


def test_a_clip_in_no_place_is_found_even_where_all_digests_fit(tiny: SimpleNamespace) -> None:
    key = _publish(tiny, drop=1)
    assert ("unit.lost", None, key) in _kinds(tiny.folder)


def test_a_clip_that_is_invalid_is_found_even_where_all_digests_fit(
    tiny: SimpleNamespace, make_clip: Callable[..., Clip], tmp_path: Path
) -> None:
    lost = make_clip(map_origin_cell=(50, 50))
    tiny.pack(tmp_path / "again", [*tiny.clips, lost], shard_bytes=200_000)
    [(kind, _, key)] = _kinds(tmp_path / "again")
    assert (kind, key) == ("clip.goal", lost.meta.key)


def test_an_index_row_that_contradicts_itself_is_found_and_the_digest_still_checked(tiny: SimpleNamespace) -> None:
    index = open_release(tiny.folder).index
    table = index.columns(SCHEMA.names)
    place = table.schema.get_field_index("poses_offset")
    moved = table.set_column(place, table.schema.field(place), [[64] * len(index)])
    write_index(tiny.folder / "index.parquet", moved)
    kinds = _kinds(tiny.folder)
    assert kinds[0] == ("file.changed", None, None)
    assert kinds[1:] == [("shard.layout", shard.name, None) for shard in tiny.manifest.shards]
