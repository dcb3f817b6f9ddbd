import pickle
import shutil
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest

from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.loaders.config import OrderConfig, SourceConfig
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.shards.manifest import manifest_bytes
from wsm_data.shards.selection import Selection, selection_path, write_selection


@pytest.fixture
def config(tiny: SimpleNamespace) -> SourceConfig:
    return SourceConfig(release=str(tiny.folder))


def select(folder: Path, keys: Sequence[str], name: str = "hard", digest: str = "") -> None:
    selection = Selection(
        name=name,
        release_digest=digest or open_release(folder).digest,
        rule={},
        command="wsm select",
        keys=pa.array(keys, pa.string()),
        scores=np.arange(len(keys), 0, -1, dtype=np.float64),
        why=pa.array([""] * len(keys), pa.string()),
    )
    write_selection(folder / selection_path(name), selection)


def test_a_source_has_the_clips_of_its_split_in_the_order_of_the_index(config: SourceConfig) -> None:
    index = open_release(config.release).index
    by_split = {
        split: [key for key in index.texts("key") if index.row(key).split == split] for split in ("train", "test")
    }
    for split, keys in by_split.items():
        sources = open_sources([replace(config, split=split)])
        assert sources.keys(range(sources.clips)) == keys
    everything = open_sources([replace(config, split="")])
    assert everything.keys(range(everything.clips)) == index.texts("key")


def test_a_clip_that_no_shard_has_room_for_is_refused_before_a_batch_takes_memory_for_it(config: SourceConfig) -> None:
    """RGB latents of a clip take two bytes for each of their values."""
    [table] = open_sources([config]).tables
    longest = int(table.column("latents").max())
    channels = table.release.manifest.codec.channels
    cells = table.release.manifest.encoded_height_px * table.release.manifest.encoded_width_px // 16**2
    for room, is_kept in ((longest * channels * cells * 2, True), (longest * channels * cells * 2 - 1, False)):
        shards = tuple(replace(shard, clips=0, bytes=room) for shard in table.release.manifest.shards)
        release = replace(table.release, manifest=replace(table.release.manifest, shards=shards))
        with nullcontext() if is_kept else pytest.raises(IntegrityError, match=f"a clip has {longest} latents"):
            assert len(replace(table, release=release).layout.latents) == len(table)


def test_refs_count_over_all_sources(config: SourceConfig) -> None:
    sources = open_sources([config, replace(config, split="test"), replace(config, split="")])
    assert [table.base for table in sources.tables] == [0, 5, 7]
    assert sources.clips == 14
    found = [sources.locate(ref) for ref in range(sources.clips)]
    assert [(sources.tables.index(table), number) for table, number in found] == [
        (source, number) for source, clips in enumerate((5, 2, 7)) for number in range(clips)
    ]
    assert sources.keys(range(14)) == [table.keys([number])[0] for table, number in found]
    assert sources.keys(np.array([13, 0, 6])) == [sources.keys([ref])[0] for ref in (13, 0, 6)]
    for ref in (-1, 14):
        with pytest.raises(ValueError, match=f"below 14, found {ref}"):
            sources.locate(ref)


def test_columns_and_rows_are_those_of_the_index(config: SourceConfig) -> None:
    [table] = open_sources([config]).tables
    for number in range(len(table)):
        row = table.index_row(number)
        assert table.keys([number]) == [row.key]
        assert table.shards[table.shard_codes[number]] == row.shard
        assert table.column("latents")[number] == row.latents
        assert table.column("clip_offset")[number] == row.clip_offset
        assert int(table.column("poses_checksum")[number]) == int(row.members[3].checksum, 16)


def test_the_layout_counts_the_clips_of_each_shard(config: SourceConfig, tiny: SimpleNamespace) -> None:
    [table] = open_sources([config]).tables
    assert table.layout.shard_clips.tolist() == [
        shard.clips for shard in tiny.manifest.shards if shard.split == "train"
    ]
    assert table.layout.latents.tolist() == [table.index_row(number).latents for number in range(len(table))]


def test_a_selection_leaves_the_clips_that_it_lists(config: SourceConfig, tiny: SimpleNamespace) -> None:
    every = open_sources([config])
    wanted = every.keys([4, 1])
    test_key = open_sources([replace(config, split="test")]).keys([0])[0]
    select(tiny.folder, [*wanted, test_key])
    sources = open_sources([replace(config, selection="hard")])
    assert sources.keys(range(sources.clips)) == sorted(wanted, key=lambda key: wanted[::-1].index(key))
    assert sources.layouts[0].shard_clips.sum() == 2
    assert open_sources([replace(config, selection="hard", split="")]).clips == 3
    by_path = open_sources([replace(config, selection=str(tiny.folder / "selections" / "hard.parquet"))])
    assert by_path.identity() == sources.identity()


def test_a_selection_of_other_clips_has_another_identity(config: SourceConfig, tiny: SimpleNamespace) -> None:
    keys = open_sources([config]).keys(range(5))
    identities = []
    for chosen in (keys[:2], keys[1:3]):
        select(tiny.folder, chosen)
        identities.append(open_sources([replace(config, selection="hard")]).identity())
    assert identities[0] != identities[1]


def test_a_selection_of_another_release_is_refused_with_both_digests(
    config: SourceConfig, tiny: SimpleNamespace
) -> None:
    select(tiny.folder, open_sources([config]).keys([0]), digest="of another")
    with pytest.raises(ConfigError, match=r"with digest of another, but .* has digest [0-9a-f]{64}"):
        open_sources([replace(config, selection="hard")])


def test_wrong_requests_say_what_there_is(config: SourceConfig, tiny: SimpleNamespace) -> None:
    with pytest.raises(ConfigError, match="must have clips of split 'validation', found test, train; set split"):
        open_sources([replace(config, split="validation")])
    with pytest.raises(ConfigError, match="at least one source"):
        open_sources([])
    with pytest.raises(ConfigError, match="there is no selection"):
        open_sources([replace(config, selection="none")])
    select(tiny.folder, open_sources([replace(config, split="test")]).keys([0]))
    with pytest.raises(ConfigError, match=r"must have clips, but .* has none of split train and selection hard"):
        open_sources([replace(config, selection="hard")])


def test_sources_of_other_codecs_or_image_sizes_are_not_mixed(config: SourceConfig, tiny: SimpleNamespace) -> None:
    other = shutil.copytree(tiny.folder, tiny.folder.with_name("other"))
    both = [config, SourceConfig(release=str(other), split="test")]
    codec = replace(tiny.codec, digest="another")
    (other / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, codec=codec)))
    with pytest.raises(ConfigError, match=r"latents of codecs must not be mixed; found dct .digest another"):
        open_sources(both)
    (other / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, encoded_width_px=320)))
    with pytest.raises(ConfigError, match=r"images of one size: .* has \(160, 96\), .*other has \(320, 96\)"):
        open_sources(both)


def test_sources_cross_to_another_process_as_settings(config: SourceConfig) -> None:
    sources = open_sources([config, replace(config, split="test")])
    copy = pickle.loads(pickle.dumps(sources))  # noqa: S301 - what DataLoader does with a worker's arguments
    assert copy.identity() == sources.identity()
    order = OrderConfig(global_batch=2)
    np.testing.assert_array_equal(copy.order_epoch(order, 1).slots, sources.order_epoch(order, 1).slots)
