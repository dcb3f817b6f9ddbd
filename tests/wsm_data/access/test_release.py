import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fsspec
import numpy as np
import pytest

from wsm_data.access.local_shards import LocalShards
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.clip import MEMBERS, Clip
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import write_index
from wsm_data.shards.manifest import manifest_bytes, release_digest


@pytest.fixture
def in_memory(tiny: SimpleNamespace) -> Iterator[str]:
    """URL of a copy of the release in fsspec's memory store."""
    filesystem = fsspec.filesystem("memory")
    for path in tiny.folder.iterdir():
        filesystem.pipe(f"/shards-test/{path.name}", path.read_bytes())
    yield "memory://shards-test"
    filesystem.rm("/shards-test", recursive=True)


def test_every_clip_comes_back_to_the_bit(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    for clip in tiny.clips:
        read = release.read_clip(clip.meta.key)
        assert read.meta == clip.meta
        assert all(read.arrays()[name].tobytes() == array.tobytes() for name, array in clip.arrays().items())


def test_a_release_is_read_and_verified_from_a_store(in_memory: str, tiny: SimpleNamespace) -> None:
    release = open_release(in_memory)
    clip = tiny.clips[4]
    np.testing.assert_array_equal(release.read_clip(clip.meta.key).rgb_latent, clip.rgb_latent)
    assert verify_release(in_memory) == []


def test_a_clip_that_reaches_beyond_its_shard_is_refused_before_memory_is_taken(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    row = release.index.row_at(0)
    less = row.clip_offset + row.clip_size - 1
    shards = tuple(replace(shard, clips=0, bytes=less) for shard in release.manifest.shards)
    short = replace(release, manifest=replace(release.manifest, shards=shards))
    for read in (short.read_clip, short.read_clip_bytes, lambda _: short.read_member(row, "poses")):
        with pytest.raises(IntegrityError, match=f"by the manifest the shard has {less} bytes"):
            read(row.key)


def test_a_clip_costs_one_ranged_read_and_no_copy(tiny: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    release = open_release(tiny.folder)
    reads: list[memoryview] = []
    original = LocalShards.read_into

    def counted(shards: LocalShards, shard: str, offset: int, buffers: Sequence[memoryview]) -> None:
        original(shards, shard, offset, buffers)
        reads.extend(buffers)

    monkeypatch.setattr(LocalShards, "read_into", counted)
    clip = release.read_clip(tiny.clips[0].meta.key)
    [data] = reads
    buffer = np.frombuffer(data, np.uint8)
    assert all(np.shares_memory(array, buffer) for array in clip.arrays().values())
    assert not any(array.flags.writeable for array in clip.arrays().values())


def test_manifest_inventory_and_quarantine_are_at_hand(tiny: SimpleNamespace) -> None:
    release = open_release(str(tiny.folder))
    assert release.manifest == tiny.manifest
    assert [row.unit for row in release.inventory if row.reason] == [line["unit"] for line in release.quarantine]


def test_a_folder_without_manifest_is_unfinished(tiny: SimpleNamespace) -> None:
    (tiny.folder / "dataset.json").unlink()
    with pytest.raises(IntegrityError, match="the release is unfinished"):
        open_release(tiny.folder)


@pytest.mark.parametrize("inside", ["pack/release", "release"])
def test_the_folder_of_a_run_is_refused_with_the_place_of_its_release(
    inside: str, tiny: SimpleNamespace, tmp_path: Path
) -> None:
    shutil.copytree(tiny.folder, tmp_path / "run" / inside)
    with pytest.raises(ConfigError, match=f"is no release, but holds one: give {tmp_path / 'run' / inside}$"):
        open_release(tmp_path / "run")


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b"\xff\x00"])
def test_a_manifest_that_is_none_says_what_to_do(content: bytes, tiny: SimpleNamespace) -> None:
    (tiny.folder / "dataset.json").write_bytes(content)
    with pytest.raises(IntegrityError, match=r"Fetch the release again, or write it again with `wsm pack`$"):
        open_release(tiny.folder)


@pytest.mark.parametrize("place", ["nowhere", "memory://nowhere-at-all"])
def test_no_folder_is_a_wrong_request(place: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no release at"):
        open_release(place if "://" in place else tmp_path / place)


def test_another_schema_version_is_refused(tiny: SimpleNamespace) -> None:
    (tiny.folder / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, schema_version=7)))
    with pytest.raises(IntegrityError, match="schema_version must be 1, found 7"):
        open_release(tiny.folder)


def test_an_index_that_was_changed_or_removed_is_refused(tiny: SimpleNamespace) -> None:
    path = tiny.folder / "index.parquet"
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(IntegrityError, match=r"index\.parquet must have sha256"):
        open_release(tiny.folder)
    path.unlink()
    with pytest.raises(IntegrityError, match=r"index\.parquet is missing"):
        open_release(tiny.folder)


def test_an_index_that_is_replaced_later_is_not_believed(tiny: SimpleNamespace, tmp_path: Path) -> None:
    release = open_release(tiny.folder)
    write_index(tmp_path / "other", SCHEMA.empty_table())
    (tmp_path / "other").replace(tiny.folder / "index.parquet")
    with pytest.raises(IntegrityError, match="was changed since the release was opened; open the release again"):
        release.index.texts("key")


def test_a_release_knows_its_digest(tiny: SimpleNamespace) -> None:
    assert open_release(tiny.folder).digest == release_digest(tiny.manifest)


def test_an_index_of_another_length_than_counted_is_refused(tiny: SimpleNamespace) -> None:
    (tiny.folder / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, clips=8)))
    with pytest.raises(IntegrityError, match="counts 8 clips, the index has 7 rows"):
        open_release(tiny.folder)


@pytest.mark.parametrize("name", ["inventory.parquet", "quarantine.jsonl"])
def test_a_changed_inventory_or_quarantine_is_refused_when_asked_for(tiny: SimpleNamespace, name: str) -> None:
    (tiny.folder / name).write_bytes((tiny.folder / name).read_bytes() + b"\n")
    release = open_release(tiny.folder)
    with pytest.raises(IntegrityError, match=f"{name} must have sha256"):
        getattr(release, name.partition(".")[0])


@pytest.mark.parametrize("name", [*MEMBERS, "meta"])
def test_a_damaged_member_is_named_with_shard_and_clip(tiny: SimpleNamespace, name: str) -> None:
    release = open_release(tiny.folder)
    row = release.index.row(tiny.clips[2].meta.key)
    member = next(member for member in row.members if member.name == name)
    path = tiny.folder / row.shard
    data = bytearray(path.read_bytes())
    data[row.clip_offset + member.array_offset + member.array_size // 2] ^= 0x10
    path.write_bytes(data)
    with pytest.raises(IntegrityError, match=rf"{row.shard}, clip {row.key}: the checksum of {member.file_name}"):
        release.read_clip(row.key)


def test_a_shard_that_is_cut_or_missing_is_named(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    row = release.index.row(tiny.clips[2].meta.key)
    path = tiny.folder / row.shard
    path.write_bytes(path.read_bytes()[: row.clip_offset + 700])
    with pytest.raises(IntegrityError, match=rf"clip {row.key}: {row.shard} in .* must reach byte"):
        release.read_clip(row.key)
    path.unlink()
    with pytest.raises(IntegrityError, match=rf"clip {row.key}: {row.shard} is missing from"):
        open_release(tiny.folder).read_clip(row.key)


def test_another_codec_is_refused_by_both_names(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    release.require_codec(tiny.codec)
    with pytest.raises(ConfigError, match=r"encoded with dct \(digest c0dec\).*found wan \(digest w\)"):
        release.require_codec(replace(tiny.codec, name="wan", digest="w"))


def test_a_clip_of_another_codec_than_the_release_is_refused(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    manifest = replace(release.manifest, codec=replace(tiny.codec, digest="other"))
    with pytest.raises(IntegrityError, match="codec digest other, found"):
        replace(release, manifest=manifest).read_clip(tiny.clips[0].meta.key)


def test_a_clip_that_is_not_there_is_a_wrong_request(tiny: SimpleNamespace, make_clip: Callable[..., Clip]) -> None:
    with pytest.raises(ConfigError, match="has no clip 'a/b/c'"):
        open_release(tiny.folder).read_clip("a/b/c")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # webdataset leaves its file open
def test_the_snippets_of_the_documentation_run_beside_a_release(
    tiny: SimpleNamespace, format_document: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tiny.folder.parent)
    snippets = re.findall(r"```python\n(.*?)```", format_document, re.DOTALL)
    assert len(snippets) == 4
    for number, snippet in enumerate(snippets):
        exec(compile(snippet, f"docs/format.md, snippet {number}", "exec"), {})  # noqa: S102 - our own document


def test_a_release_has_a_length_items_and_an_order(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    assert len(release) == len(tiny.clips) == 7
    assert [clip.meta.key for clip in release] == release.keys() == release.index.texts("key")
    assert release[release.keys()[3]].meta.key == release.keys()[3]
    assert sorted(key for split in release.index.counts("split") for key in release.keys(split=split)) == sorted(
        release.keys()
    )


def test_a_release_and_its_clips_are_shown_in_a_line(tiny: SimpleNamespace) -> None:
    release = open_release(tiny.folder)
    assert repr(release).startswith(f"<Release {release.manifest.name}: 7 clips (")
    assert max(len(repr(clip)) for clip in release) < 200


def test_a_clip_is_decoded_by_its_key_to_what_its_codec_decodes(homes_release: Path) -> None:
    release = open_release(homes_release)
    clip = next(iter(release))
    decoded = release.decode(clip.meta.key)
    assert decoded.rgb.shape == (clip.frame_count, clip.intrinsics.height, clip.intrinsics.width, 3)
    assert decoded.depth_m.shape == decoded.rgb.shape[:3]
    video = release.codec().decode(clip.rgb_latent.astype(np.float32))
    assert np.abs(decoded.rgb / 127.5 - 1 - video.clip(-1, 1)).max() < 1 / 127.5  # one step of 256
