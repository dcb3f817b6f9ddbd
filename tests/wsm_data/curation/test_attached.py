"""Scores and a selection in a release: whole they are passed over, damaged anywhere they are named."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from wsm_data.access.release import open_release
from wsm_data.curation.attached import attached_names, check_attached
from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.scores_table import Direction, ScorerInfo, ScoreTable, read_paths, read_scores, write_scores
from wsm_data.shards.selection import Selection, parse_selection, write_selection

SCORER = ScorerInfo(name="cost", unit="ratio", direction=Direction.HIGHER, summary="what it costs")


@pytest.fixture
def release(tiny):
    release = open_release(tiny.folder)
    keys = release.index.columns(["key"])["key"].combine_chunks().cast(pa.string())
    costs = np.linspace(1.0, 2.0, len(keys))
    table = ScoreTable(release_digest=release.digest, scorers=(SCORER,), keys=keys, columns={"cost": costs})
    paths = np.random.default_rng(0).normal(size=(len(keys), 32, 2)).astype(np.float32)
    write_scores(tiny.folder / "scores.parquet", table, Outlines(xy_m=paths, floor_z_m=paths[:, 0, 0].copy()))
    chosen = Selection(
        name="hard", release_digest=release.digest, rule={"by": "cost"}, command="wsm select", keys=keys,
        scores=costs, why=pa.array(["cost"] * len(keys)),
    )  # fmt: skip
    (tiny.folder / "selections").mkdir()
    write_selection(tiny.folder / "selections/hard.parquet", chosen)
    return release


def found(release):
    return [str(one.kind) for name in attached_names(release.store) for one in check_attached(release, name)]


def content(release, path):
    """All that is read of a file, as values."""
    if path.name != "scores.parquet":
        one = parse_selection(path.read_bytes(), "")
        return one.name, one.release_digest, one.rule, one.command, one.keys, one.scores.tobytes(), one.why
    table, paths = read_scores(path, release_digest=release.digest), read_paths(path, np.arange(len(release.index)))
    columns = {name: values.tobytes() for name, values in table.columns.items()}
    return table.scorers, table.keys, columns, paths.xy_m.tobytes(), paths.floor_z_m.tobytes()


def test_what_is_whole_has_no_finding_and_where_nothing_stands_nothing_is_looked_at(release, tiny):
    assert attached_names(release.store) == ["scores.parquet", "selections/hard.parquet"]
    assert found(release) == []
    (tiny.folder / "scores.parquet").unlink()
    (tiny.folder / "selections/hard.parquet").unlink()
    assert attached_names(release.store) == []


@pytest.mark.parametrize("name", ["scores.parquet", "selections/hard.parquet"])
def test_any_flipped_bit_is_found_or_changes_nothing_that_is_read(release, tiny, name):
    path = tiny.folder / name
    data = path.read_bytes()
    whole, named = content(release, path), 0
    for place in range(0, len(data), max(1, len(data) // 300)):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1 << place % 8]) + data[place + 1 :])
        if findings := found(release):
            assert findings == ["attached.changed"]
            named += 1
        else:
            assert content(release, path) == whole, place
    assert named > 150  # the others are statistics and sizes that nothing is read from


@pytest.mark.parametrize("name", ["scores.parquet", "selections/hard.parquet"])
@pytest.mark.parametrize("size", [0, 3, 200])
def test_a_file_that_was_cut_is_found(release, tiny, name, size):
    path = tiny.folder / name
    path.write_bytes(path.read_bytes()[:size])
    assert found(release) == ["attached.changed"]


def test_what_was_made_from_another_release_is_no_damage_and_is_warned_of(release, caplog):
    assert found(replace(release, digest="another")) == []
    assert caplog.text.count("not from this one; make it again") == 2
