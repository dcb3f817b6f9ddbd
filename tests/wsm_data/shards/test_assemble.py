import json
import platform
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wsm_data.access.verify import verify_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.clip import Clip
from wsm_data.schema.depth import DepthRange
from wsm_data.shards.assemble import begin_release
from wsm_data.shards.inventory import InventoryRow, UnitState


def test_a_release_holds_these_files(tiny: SimpleNamespace) -> None:
    shards = [shard.name for shard in tiny.manifest.shards]
    assert len(shards) == 3
    others = ["dataset.json", "index.parquet", "inventory.parquet", "quarantine.jsonl"]
    assert sorted(path.name for path in tiny.folder.iterdir()) == sorted(shards + others)


def test_the_manifest_counts_what_is_there(tiny: SimpleNamespace) -> None:
    manifest = tiny.manifest
    assert (manifest.clips, manifest.clips_by_split) == (7, {"test": 2, "train": 5})
    assert manifest.clips_by_group == {"synth_d435i": 4, "synth_zed": 3}
    assert manifest.latents == sum(clip.latent_count for clip in tiny.clips)
    assert manifest.frames == sum(clip.frame_count for clip in tiny.clips)
    assert manifest.drops == {"archive.truncated": 1, "path.through_obstacle": 1}


def test_statistics_are_those_of_the_training_latents(tiny: SimpleNamespace) -> None:
    train = [
        clip
        for clip in tiny.clips
        if clip.meta.key not in ("synth_d435i/home_0003/000007", "synth_zed/home_0003/000001")
    ]
    for name in ("rgb", "depth"):
        values = np.concatenate([getattr(clip, f"{name}_latent") for clip in train]).astype(float)
        statistics = getattr(tiny.manifest, f"{name}_statistics")
        assert statistics.count == values[:, 0].size
        np.testing.assert_allclose(statistics.mean, values.mean((0, 2, 3)), rtol=0, atol=1e-13)  # float64 rounding
        np.testing.assert_allclose(statistics.std, values.std((0, 2, 3)), rtol=1e-12)


def test_the_same_clips_in_another_order_give_the_same_bytes(tiny: SimpleNamespace, tmp_path: Path) -> None:
    tiny.pack(tmp_path / "again", tiny.clips[::-1], shard_bytes=200_000)
    files = sorted(path.name for path in tiny.folder.iterdir())
    assert files == sorted(path.name for path in (tmp_path / "again").iterdir())
    for name in files:
        assert (tiny.folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name


def test_the_size_of_the_shards_does_not_change_the_statistics(tiny: SimpleNamespace, tmp_path: Path) -> None:
    other = tiny.pack(tmp_path / "again", tiny.clips, shard_bytes=1)
    assert len(other.shards) == 7
    assert other.rgb_statistics == tiny.manifest.rgb_statistics
    assert other.depth_statistics == tiny.manifest.depth_statistics


def test_no_place_or_machine_stands_in_the_release(tiny: SimpleNamespace) -> None:
    for path in tiny.folder.iterdir():
        data = path.read_bytes()
        assert str(tiny.folder.parent).encode() not in data, path.name
        assert platform.node().encode() not in data, path.name


def test_shards_of_an_earlier_plan_are_removed_and_other_files_stay(tiny: SimpleNamespace) -> None:
    (tiny.folder / "train-000007.tar").write_bytes(b"an earlier plan")
    (tiny.folder / "notes.tar").write_bytes(b"somebody's")
    (tiny.folder / "scores.parquet").write_bytes(b"made later")
    tiny.pack(tiny.folder, tiny.clips, shard_bytes=10_000_000)
    names = {path.name for path in tiny.folder.iterdir()}
    assert {name for name in names if name.endswith(".tar")} == {"train-000000.tar", "test-000000.tar", "notes.tar"}
    assert "scores.parquet" in names


def test_a_release_is_unfinished_from_the_moment_it_is_packed_again(tiny: SimpleNamespace) -> None:
    begin_release(tiny.folder)
    assert not (tiny.folder / "dataset.json").exists()
    begin_release(tiny.folder / "not there yet")


def test_a_kill_before_the_end_leaves_no_manifest(tiny: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("wsm_data.shards.assemble.write_quarantine", killed)
    with pytest.raises(KeyboardInterrupt):
        tiny.pack(tiny.folder, tiny.clips, shard_bytes=200_000)
    assert not (tiny.folder / "dataset.json").exists()


def test_a_shard_that_is_missing_or_of_another_size_is_refused(tiny: SimpleNamespace, tmp_path: Path) -> None:
    wrong = [replace(shard, bytes=shard.bytes + 512) for shard in tiny.manifest.shards]
    with pytest.raises(IntegrityError, match=r"test-000000\.tar must be the shard of"):
        tiny.pack(tmp_path / "again", tiny.clips, shard_bytes=200_000, shards=wrong)


@pytest.mark.parametrize("change", [{"codec_digest": "other"}, {"depth_range": DepthRange(max_m=9.0)}])
def test_a_clip_of_other_settings_is_refused_by_name(
    tiny: SimpleNamespace, make_clip: Callable[..., Clip], tmp_path: Path, change: dict[str, object]
) -> None:
    stranger = make_clip("synth_zed/home_0001/000099", **change)
    with pytest.raises(ConfigError, match="clip synth_zed/home_0001/000099 has"):
        tiny.pack(tmp_path / "again", [*tiny.clips, stranger], shard_bytes=200_000)


def test_a_release_without_training_clips_has_no_statistics(tiny: SimpleNamespace, tmp_path: Path) -> None:
    manifest = tiny.pack(tmp_path / "again", tiny.clips[-2:], shard_bytes=200_000)
    assert manifest.clips_by_split == {"test": 2}
    assert (manifest.rgb_statistics.count, manifest.rgb_statistics.mean) == (0, ())
    assert verify_release(tmp_path / "again") == []


def test_a_release_of_refusals_alone_is_sound(tiny: SimpleNamespace, tmp_path: Path) -> None:
    manifest = tiny.pack(tmp_path / "again", [], shard_bytes=200_000)
    assert (manifest.clips, manifest.shards) == (0, ())
    assert verify_release(tmp_path / "again") == []


def test_pending_units_are_counted(tiny: SimpleNamespace, tmp_path: Path) -> None:
    pending = [InventoryRow(unit="synth_zed/home_0009/000001", container="c", state=UnitState.PENDING)]
    manifest = tiny.pack(tmp_path / "again", [], shard_bytes=1, inventory=pending, refusals=[])
    assert json.loads((tmp_path / "again" / "dataset.json").read_text())["pending"] == manifest.pending == 1
