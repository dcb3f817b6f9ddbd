"""A merged release is what packing all clips together gives: the same shards, index and statistics."""

import pytest
from tiny_release import build_clip, pack

from wsm_data.access.derived.merge import merge_releases
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError
from wsm_data.files.digest import sha256_bytes

SHARD_BYTES = 200_000


def clip_of(unit, number):
    return build_clip(unit, latents=3 + number % 3, source_digest=sha256_bytes(unit.encode())[:32])


@pytest.fixture
def halves(tmp_path):
    """Folders of two releases of three clips each, without refusals, and of one of all six."""
    units = [f"synth_d435i/home_{number:04d}/{number:06d}" for number in range(11, 17)]
    clips = [clip_of(unit, number) for number, unit in enumerate(units)]
    parts = {"a": clips[:3], "b": clips[3:], "all": clips}
    for name, chosen in parts.items():
        pack(tmp_path / name, chosen, shard_bytes=SHARD_BYTES, refusals=(), inventory=_clips_of(chosen))
    return tmp_path


def _clips_of(clips):
    from tiny_release import _inventory

    return [row for row in _inventory(clips) if row.state == "clip"]


def merged(folder, *names):
    merge_releases([open_release(folder / name) for name in names], folder / "merged", "tiny", SHARD_BYTES)
    return open_release(folder / "merged")


def test_shards_index_and_statistics_are_those_of_packing_all(halves):
    together, packed = merged(halves, "a", "b"), open_release(halves / "all")
    assert verify_release(halves / "merged") == []
    assert together.manifest.shards == packed.manifest.shards
    assert together.index.columns(["key", "shard", "clip_offset", "meta_offset"]).equals(
        packed.index.columns(["key", "shard", "clip_offset", "meta_offset"])
    )
    assert together.manifest.rgb_statistics == packed.manifest.rgb_statistics
    assert together.manifest.depth_statistics == packed.manifest.depth_statistics


def test_the_order_in_which_they_are_named_changes_no_shard(halves):
    assert merged(halves, "b", "a").manifest.shards == open_release(halves / "all").manifest.shards


def test_the_digest_of_each_stands_in_the_manifest(halves):
    fingerprints = merged(halves, "a", "b").manifest.fingerprints
    assert fingerprints["merged.1.release"] == open_release(halves / "a").digest
    assert fingerprints["merged.2.release"] == open_release(halves / "b").digest
    assert fingerprints["merged.2.encode"] == "f1"


def test_a_trajectory_in_both_is_refused(halves):
    with pytest.raises(ConfigError, match="no unit in common to be merged, found 3"):
        merged(halves, "a", "all")
    assert not (halves / "merged").exists()
