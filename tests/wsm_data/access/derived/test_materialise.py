from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from wsm_data.access.derived.materialise import copy_shard, finish_selection, lay_out_selection
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import IntegrityError
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import Selection


def choose(release, rows):
    keys = release.index.texts("key")
    return Selection(
        name="hard",
        release_digest=release_digest(release.manifest),
        rule={},
        command="",
        keys=pa.array([keys[row] for row in rows]),
        scores=np.linspace(1, 0, len(rows)),
        why=pa.array([""] * len(rows)),
    )


@pytest.fixture
def materialise(tiny, tmp_path):
    def go(rows=(3, 0, 2), shard_bytes=1 << 30, folder="own", **changes):
        release = open_release(tiny.folder)
        release = replace(release, manifest=replace(release.manifest, **changes))
        selection = choose(release, rows)
        layouts = lay_out_selection(release, selection, shard_bytes)
        shards = [copy_shard(tmp_path / folder / layout.name, layout, release) for layout in layouts]
        finish_selection(
            tmp_path / folder, release, selection, layouts=layouts, shards=shards, fingerprints={"selection": "5e1ec7"}
        )
        return tmp_path / folder

    return go


def test_a_selection_becomes_a_sound_release_of_its_clips(materialise, tiny):
    parent, own = open_release(tiny.folder), open_release(materialise())
    assert verify_release(own.store.root) == []
    assert sorted(own.index.texts("key")) == sorted(parent.index.texts("key")[row] for row in (3, 0, 2))
    for key in own.index.texts("key"):
        assert own.read_clip_bytes(key) == parent.read_clip_bytes(key)


def test_it_names_its_parent_and_is_standardised_as_its_parent(materialise, tiny):
    parent, own = open_release(tiny.folder).manifest, open_release(materialise()).manifest
    assert own.parent == release_digest(parent)
    assert own.name == "tiny-hard"
    assert own.fingerprints == {**parent.fingerprints, "selection": "5e1ec7"}
    for field in ("rgb_statistics", "depth_statistics", "codec", "licences", "depth_range", "codec_quality"):
        assert getattr(own, field) == getattr(parent, field)


@pytest.mark.parametrize("partial", [False, True])
def test_what_was_chosen_from_a_part_of_the_source_says_so(materialise, partial):
    assert open_release(materialise(partial=partial)).manifest.partial is partial


def test_its_inventory_is_that_of_the_chosen_clips(materialise):
    own = open_release(materialise())
    assert len(own.inventory) == 3
    assert (own.quarantine, dict(own.manifest.drops)) == ((), {})


def test_it_may_have_several_shards_and_splits(materialise, tiny):
    rows = range(len(tiny.clips))
    own = open_release(materialise(rows, shard_bytes=200_000))
    assert verify_release(own.store.root) == []
    assert own.manifest.clips_by_split == open_release(tiny.folder).manifest.clips_by_split
    assert len(own.manifest.shards) > 2


def test_the_order_of_the_selection_does_not_change_a_byte(materialise):
    first, second = materialise((3, 0, 2), folder="a"), materialise((0, 2, 3), folder="b")
    assert {path.name: path.read_bytes() for path in first.iterdir()} == {
        path.name: path.read_bytes() for path in second.iterdir()
    }


def test_values_that_no_chosen_clip_has_are_left_behind(materialise, tiny):
    own = open_release(materialise((0,)))
    assert own.index.codes("physical_scene")[1] == (own.index.texts("physical_scene")[0],)


def test_a_damaged_clip_is_not_copied(materialise, tiny):
    release = open_release(tiny.folder)
    row = release.index.row_at(3)
    shard = tiny.folder / row.shard
    data = bytearray(shard.read_bytes())
    data[row.clip_offset + row.members[0].array_offset] ^= 1
    shard.write_bytes(bytes(data))
    with pytest.raises(IntegrityError, match=f"{row.shard}, clip {row.key}: the checksum of rgb_latent.npy"):
        materialise()
