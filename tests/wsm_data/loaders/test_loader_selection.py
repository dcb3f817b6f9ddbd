"""Training on a selection: the clips it lists, from the shards as they are."""

import numpy as np
import pyarrow as pa
import pytest

from wsm_data.access.derived.materialise import copy_shard, finish_selection, lay_out_selection
from wsm_data.access.release import open_release
from wsm_data.curation.diversity import DiversityConfig
from wsm_data.curation.rule import RuleConfig
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable
from wsm_data.curation.select import INDEX_COLUMNS, SelectionConfig, select_clips
from wsm_data.errors import ConfigError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import Selection, selection_path, write_selection


@pytest.fixture
def selection(tiny):
    """Three of the five training clips of the tiny release, chosen by an invented score and installed as `hard`."""
    release = open_release(tiny.folder)
    index = release.index.columns(INDEX_COLUMNS)
    info = ScorerInfo(name="detour_ratio", unit="ratio", direction=Direction.HIGHER, summary="invented")
    scores = ScoreTable(
        release_digest=release_digest(release.manifest),
        scorers=(info,),
        keys=pa.array(index["key"].to_pylist()),
        columns={"detour_ratio": np.arange(len(index), dtype=np.float64)},
    )
    config = SelectionConfig(
        fraction=0.6, rule=RuleConfig(weights={"detour_ratio": 1.0}), diversity=DiversityConfig(within_m=0.0)
    )
    chosen = select_clips(index, scores, lambda rows: rows, config)
    found = Selection(
        name="hard",
        release_digest=scores.release_digest,
        rule={},
        command="wsm select RELEASE",
        keys=scores.keys.take(pa.array(chosen.rows)),
        scores=chosen.difficulty,
        why=chosen.why,
    )
    write_selection(tiny.folder / selection_path("hard"), found)
    return found


def epoch_of(release, **source):
    """Colour latents of every clip of an epoch, by key."""
    config = LoaderConfig(
        sources=(SourceConfig(release=str(release), **source),),
        order=OrderConfig(global_batch=1),
        read=ReadConfig(threads=0),
    )
    with ClipLoader(config, rank=0, world_size=1) as loader:
        return {batch.keys[0]: batch.rgb[0].numpy().copy() for batch in loader}


def test_an_epoch_brings_the_chosen_clips_and_no_shard_is_written(tiny, selection):
    before = {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in tiny.folder.glob("*.tar")}
    found = epoch_of(tiny.folder, selection="hard")
    assert sorted(found) == sorted(selection.keys.to_pylist())
    everything = epoch_of(tiny.folder)
    assert len(found) < len(everything)
    for key, latents in found.items():
        np.testing.assert_array_equal(latents, everything[key])
    assert {path.name: (path.read_bytes(), path.stat().st_mtime_ns) for path in tiny.folder.glob("*.tar")} == before


def test_a_selection_may_lie_anywhere(tiny, selection, tmp_path):
    write_selection(tmp_path / "elsewhere.parquet", selection)
    found = epoch_of(tiny.folder, selection=str(tmp_path / "elsewhere.parquet"))
    assert sorted(found) == sorted(selection.keys.to_pylist())


def test_the_selection_as_a_release_of_its_own_delivers_the_same_numbers(tiny, selection, tmp_path):
    release = open_release(tiny.folder)
    layouts = lay_out_selection(release, selection, 1 << 30)
    shards = [copy_shard(tmp_path / "own" / layout.name, layout, release) for layout in layouts]
    finish_selection(tmp_path / "own", release, selection, layouts=layouts, shards=shards, fingerprints={})
    by_name, own = epoch_of(tiny.folder, selection="hard"), epoch_of(tmp_path / "own")
    assert by_name.keys() == own.keys()
    for key, latents in own.items():
        np.testing.assert_array_equal(latents, by_name[key])


def test_a_selection_of_another_release_is_refused_before_a_shard_is_read(tiny, selection, tmp_path):
    tiny.pack(tmp_path / "other", tiny.clips[:4], shard_bytes=1 << 30)
    write_selection(tmp_path / "other" / selection_path("hard"), selection)
    with pytest.raises(ConfigError, match=f"digest {selection.release_digest}, but the release at"):
        epoch_of(tmp_path / "other", selection="hard")
