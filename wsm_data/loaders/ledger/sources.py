"""The sources and the order a ledger was recorded with, from its identity and the releases at hand."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wsm_data.access.release import read_manifest
from wsm_data.errors import ConfigError
from wsm_data.files.differences import differences
from wsm_data.files.stores import open_store
from wsm_data.loaders.config import Arrangement, OrderConfig, Remainder, SourceConfig
from wsm_data.loaders.sources.clips import Sources, open_sources
from wsm_data.loaders.sources.queries import QueryConfig, open_queries
from wsm_data.shards.manifest import release_digest


def recorded_order(identity: Mapping[str, Any]) -> OrderConfig:
    """The order settings of a run."""
    stated = dict(identity["order"])
    stated["remainder"] = Remainder(stated["remainder"])
    stated["arrangement"] = Arrangement(stated["arrangement"])
    stated["chunk_sizes"] = tuple(stated["chunk_sizes"])
    return OrderConfig(**stated)


def open_recorded_sources(identity: Mapping[str, Any], releases: Sequence[str], selections: Sequence[str]) -> Sources:
    """Open the sources of a run.

    Args:
        identity: identity of the run, from its ledger.
        releases: paths or URLs of its releases, in any order; they are told apart by their digests.
        selections: paths of its selection files, in the order of the sources that have one; empty where all stand in
            their releases.

    Raises:
        ConfigError: a release or selection is missing, or is another than that of the run.
        IntegrityError: a release is damaged.
    """
    places = {release_digest(read_manifest(open_store(release))): release for release in releases}
    remaining = list(selections)
    configs = []
    for source in identity["sources"]:
        if source["release_digest"] not in places:
            raise ConfigError(
                f"the run read the release {source['release']} with digest {source['release_digest']}, but none of the "
                f"releases given has it: {', '.join(releases)}; give its place by --release"
            )
        selection = remaining.pop(0) if source["selection"] and remaining else source["selection"]
        configs.append(
            SourceConfig(
                release=places[source["release_digest"]],
                selection=selection,
                split=source["split"],
                weight=source["weight"],
            )
        )
    queries = identity["sources"][0].get("queries")
    sources = open_sources(configs) if queries is None else open_queries(configs, QueryConfig(**queries))
    lines = differences({"sources": identity["sources"]}, {"sources": sources.identity()})
    if lines:
        raise ConfigError(
            "the releases and selections given do not make the clips of the run\n  "
            + "\n  ".join(lines)
            + "\nGive the selection of the run by --selection"
        )
    return sources


def refs_of_key(sources: Sources, key: str) -> list[int]:
    """Refs of a clip: one for every source that has it, or one for every query.

    Raises:
        ConfigError: no source has it.
    """
    refs: list[int] = []
    for table in sources.tables:
        row = int(table.release.index.rows_of([key])[0])
        first, last = (int(np.searchsorted(table.rows, row, side)) for side in ("left", "right"))
        refs += range(table.base + first, table.base + last)
    if not refs:
        raise ConfigError(f"no source of the run has a clip {key!r}; `wsm inspect RELEASE` lists what a release has")
    return refs
