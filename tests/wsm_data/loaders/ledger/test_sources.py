import json
from dataclasses import asdict

import pyarrow as pa
import pytest

from wsm_data.errors import ConfigError
from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder, SourceConfig
from wsm_data.loaders.ledger.sources import open_recorded_sources, recorded_order, refs_of_key
from wsm_data.loaders.sources.clips import open_sources
from wsm_data.loaders.sources.queries import QueryConfig, QuerySources, open_queries
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import Selection, selection_path, write_selection


def identity_of(sources, order=None):
    """As it comes back from a ledger: through JSON."""
    return json.loads(json.dumps({"sources": sources.identity(), "order": asdict(order or OrderConfig())}))


@pytest.fixture
def two(tmp_path, tiny):
    """Two releases: all clips, and the first three."""
    tiny.pack(tmp_path / "few", tiny.clips[:3], shard_bytes=1 << 20)
    return str(tiny.folder), str(tmp_path / "few")


def write_hard(path, tiny, keys):
    selection = Selection(
        name="hard",
        release_digest=release_digest(tiny.manifest),
        rule={},
        command="wsm select",
        keys=pa.array(keys),
        scores=pa.array([float(len(keys) - rank) for rank in range(len(keys))]).to_numpy(),
        why=pa.array(["why"] * len(keys)),
    )
    write_selection(path, selection)


@pytest.mark.parametrize(
    "order",
    [
        OrderConfig(),
        OrderConfig(seed=3, remainder=Remainder.REPEAT, arrangement=Arrangement.BUCKET, chunk_sizes=(4,)),
        OrderConfig(shuffle=False, arrangement=Arrangement.JOIN, row_latents=9, max_latents=7),
    ],
)
def test_the_order_comes_back_as_it_was(tiny, order):
    sources = open_sources([SourceConfig(release=str(tiny.folder))])
    assert recorded_order(identity_of(sources, order)) == order


def test_sources_come_back_from_their_releases_in_whatever_order_these_are_given(two):
    configs = [
        SourceConfig(release=two[1], weight=0.5),
        SourceConfig(release=two[0], split=""),
        SourceConfig(release=two[0], split="test"),
    ]
    sources = open_sources(configs)
    for places in (two, two[::-1]):
        found = open_recorded_sources(identity_of(sources), places, [])
        assert [table.config for table in found.tables] == configs
        assert found.clips == sources.clips


def test_a_release_that_is_not_given_is_named(two):
    sources = open_sources([SourceConfig(release=place) for place in two])
    with pytest.raises(ConfigError, match=r"read the release tiny with digest .*, but none of the releases given"):
        open_recorded_sources(identity_of(sources), two[:1], [])


def test_a_selection_is_found_in_its_release_or_given(tiny, tmp_path):
    keys = [clip.meta.key for clip in tiny.clips]
    write_hard(tiny.folder / selection_path("hard"), tiny, keys[:3])
    sources = open_sources([SourceConfig(release=str(tiny.folder), selection="hard")])
    identity = identity_of(sources)
    assert open_recorded_sources(identity, [str(tiny.folder)], []).identity() == sources.identity()
    place = tmp_path / "elsewhere.parquet"
    (tiny.folder / selection_path("hard")).rename(place)
    assert open_recorded_sources(identity, [str(tiny.folder)], [str(place)]).identity() == sources.identity()
    write_hard(place, tiny, keys[1:4])
    with pytest.raises(
        ConfigError, match=r"(?s)sources\[0\]\.selection_sha256: .* -> .*Give the selection of the run by --selection"
    ):
        open_recorded_sources(identity, [str(tiny.folder)], [str(place)])


def test_queries_come_back_with_their_settings(tiny):
    queries = QueryConfig(queries_per_clip=2, future_latents=1)
    sources = open_queries([SourceConfig(release=str(tiny.folder))], queries)
    found = open_recorded_sources(identity_of(sources), [str(tiny.folder)], [])
    assert isinstance(found, QuerySources)
    assert found.identity() == sources.identity()


def test_a_clip_has_a_ref_in_every_source_that_has_it(two):
    sources = open_sources([SourceConfig(release=place, split="") for place in two])
    keys = sources.keys(range(sources.clips))
    for key in keys:
        assert refs_of_key(sources, key) == [ref for ref, other in enumerate(keys) if other == key]


def test_a_clip_has_a_ref_for_every_query(tiny):
    sources = open_queries([SourceConfig(release=str(tiny.folder))], QueryConfig(queries_per_clip=2, future_latents=1))
    keys = sources.keys(range(sources.clips))
    for key in keys:
        assert refs_of_key(sources, key) == [ref for ref, other in enumerate(keys) if other == key]


def test_a_clip_that_no_source_has_is_a_wrong_request(tiny):
    sources = open_sources([SourceConfig(release=str(tiny.folder), split="train")])
    test_clip = open_sources([SourceConfig(release=str(tiny.folder), split="test")]).keys([0])[0]
    for key in (test_clip, "a/b/c"):
        with pytest.raises(ConfigError, match=f"no source of the run has a clip '{key}'"):
            refs_of_key(sources, key)
