from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from wsm_data.access import verify_shard as module
from wsm_data.access.release import open_release
from wsm_data.access.verify_shard import verify_shard
from wsm_data.files.stores import LocalStore, open_store
from wsm_data.shards.findings import Finding, FindingKind
from wsm_data.shards.index.row import IndexRow
from wsm_data.shards.manifest import ShardInfo


@pytest.fixture
def shard(tiny: SimpleNamespace) -> SimpleNamespace:
    """The training shard of the most clips: its manifest entry, rows, path, and a way to check it."""
    info = max(tiny.manifest.shards, key=lambda shard: shard.clips)
    assert info.clips >= 3
    rows = tuple(open_release(tiny.folder).index.rows_of_shard(info.name))

    def check(
        shard: ShardInfo = info, rows: Sequence[IndexRow] | None = rows, progress: list[int] | None = None
    ) -> list[Finding]:
        counted = [] if progress is None else progress
        return list(verify_shard(open_store(tiny.folder), shard, rows, tiny.manifest, counted.append))

    return SimpleNamespace(info=info, rows=rows, path=tiny.folder / info.name, check=check)


def _kinds(findings: Sequence[Finding]) -> list[tuple[str, str | None]]:
    return [(str(finding.kind), finding.clip) for finding in findings]


def test_a_sound_shard_is_read_once_and_in_blocks(shard: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_READ_BYTES", 7_000)  # so that clips and members lie across blocks
    ranges: list[tuple[int, int]] = []
    original = LocalStore.read_range

    def counted(store: LocalStore, name: str, offset: int, size: int) -> bytes:
        ranges.append((offset, size))
        return original(store, name, offset, size)

    monkeypatch.setattr(LocalStore, "read_range", counted)
    progress: list[int] = []
    assert shard.check(progress=progress) == []
    assert sum(progress) == shard.info.bytes
    assert ranges == [(offset, 7_000) for offset in range(0, shard.info.bytes, 7_000)]


def test_a_missing_shard_is_named(shard: SimpleNamespace) -> None:
    shard.path.unlink()
    assert _kinds(shard.check()) == [("shard.missing", None)]


def _cut(path: Path, length: int) -> None:
    path.write_bytes(path.read_bytes()[:length])


def test_a_cut_at_a_sample_boundary_names_the_clips_that_are_lost(shard: SimpleNamespace) -> None:
    _cut(shard.path, shard.rows[1].clip_offset)
    lost = [("clip.lost", row.key) for row in shard.rows[1:]]
    assert _kinds(shard.check()) == [*lost, ("shard.size", None), ("shard.changed", None)]


def test_a_cut_at_a_member_boundary_names_the_clip_and_the_member(shard: SimpleNamespace) -> None:
    row = shard.rows[1]
    _cut(shard.path, row.clip_offset + row.members[3].header_offset)
    findings = shard.check()
    assert _kinds(findings)[:2] == [("clip.cut", row.key), ("clip.lost", shard.rows[2].key)]
    assert "ends before poses.npy, between two members" in findings[0].message


def test_a_cut_inside_a_header_names_the_clip_and_the_member(shard: SimpleNamespace) -> None:
    row = shard.rows[-1]
    _cut(shard.path, row.clip_offset + row.members[5].header_offset + 257)
    findings = shard.check()
    assert _kinds(findings) == [("clip.cut", row.key), ("shard.size", None), ("shard.changed", None)]
    assert "ends inside the header of geodesic_mm.npy" in findings[0].message


@pytest.mark.parametrize("left", [0, 1, 512, 1023])
def test_a_cut_in_the_end_of_archive_is_found(shard: SimpleNamespace, left: int) -> None:
    _cut(shard.path, shard.info.bytes - 1024 + left)
    assert _kinds(shard.check()) == [("shard.end", None), ("shard.size", None), ("shard.changed", None)]


def test_bytes_after_the_end_are_found(shard: SimpleNamespace) -> None:
    shard.path.write_bytes(shard.path.read_bytes() + bytes(512))
    assert _kinds(shard.check()) == [("shard.size", None), ("shard.changed", None)]


def test_any_changed_byte_is_found_in_its_clip(shard: SimpleNamespace) -> None:
    data = shard.path.read_bytes()
    for place in range(0, shard.info.bytes, 3989):  # a prime: all parts of members are met
        damaged = bytearray(data)
        damaged[place] ^= 0x04
        shard.path.write_bytes(damaged)
        inside = [row.key for row in shard.rows if row.clip_offset <= place < row.clip_offset + row.clip_size]
        first, last = shard.check()
        assert (first.clip, last.kind) == (inside[0] if inside else None, FindingKind.SHARD_CHANGED), place


def test_damage_in_two_clips_is_found_in_both(shard: SimpleNamespace) -> None:
    damaged = bytearray(shard.path.read_bytes())
    for row in (shard.rows[0], shard.rows[2]):
        damaged[row.clip_offset + row.members[1].array_offset] ^= 1
    shard.path.write_bytes(damaged)
    findings = [finding for finding in shard.check() if finding.kind == FindingKind.CLIP_PAYLOAD]
    assert [finding.clip for finding in findings] == [shard.rows[0].key, shard.rows[2].key]


def test_a_digest_that_belongs_to_another_file_is_found_though_every_clip_is_sound(shard: SimpleNamespace) -> None:
    assert _kinds(shard.check(replace(shard.info, sha256="0" * 64))) == [("shard.changed", None)]


def test_a_clip_the_index_leaves_out_leaves_a_gap(shard: SimpleNamespace) -> None:
    findings = shard.check(rows=(shard.rows[0], *shard.rows[2:]))
    gap = [("shard.layout", row.key) for row in shard.rows[2:3]]
    assert _kinds(findings)[:1] == gap
    assert _kinds(findings)[-1:] == [("release.count", None)]
    assert not {finding.kind for finding in findings} & {FindingKind.CLIP_PAYLOAD, FindingKind.CLIP_HEADER}


def test_clips_that_overlap_in_the_index_are_found(shard: SimpleNamespace) -> None:
    findings = shard.check(rows=(shard.rows[0], shard.rows[0], *shard.rows[1:]))
    assert _kinds(findings)[0] == ("shard.layout", shard.rows[0].key)


def test_a_clip_of_another_split_is_found(shard: SimpleNamespace) -> None:
    findings = shard.check(rows=(replace(shard.rows[0], split="test"), *shard.rows[1:]))
    assert _kinds(findings) == [("shard.layout", shard.rows[0].key)]


def test_without_an_index_the_digest_is_still_checked(shard: SimpleNamespace) -> None:
    assert shard.check(rows=None) == []
    shard.path.write_bytes(shard.path.read_bytes()[:-1] + b"\1")
    assert _kinds(shard.check(rows=None)) == [("shard.changed", None)]
