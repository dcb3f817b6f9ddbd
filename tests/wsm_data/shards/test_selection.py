import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.stores import open_store
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import (
    Selection,
    parse_selection,
    read_selection,
    selection_names,
    selection_path,
    write_selection,
)


def selection(keys=("g/s/b", "g/s/a"), **changes):
    values = {
        "name": "hard",
        "release_digest": "d1",
        "rule": {"weights": {"detour": 1.5}, "fraction": 0.1},
        "command": "wsm select RELEASE",
        "keys": pa.array(list(keys), pa.string()),
        "scores": np.linspace(1, 0.5, len(keys)),
        "why": pa.array(["detour 2.8"] * len(keys)),
    }
    return Selection(**(values | changes))


@pytest.fixture
def written(tmp_path):
    path = tmp_path / selection_path("hard")
    write_selection(path, selection())
    return path


def test_what_is_written_is_read(written, tmp_path):
    found = read_selection(tmp_path, "hard", "d1")
    expected = selection()
    assert (found.name, found.release_digest, found.rule, found.command) == (
        expected.name, expected.release_digest, expected.rule, expected.command,
    )  # fmt: skip
    assert (found.keys, found.why) == (expected.keys, expected.why)
    assert (found.ranks.tolist(), found.scores.tolist()) == ([1, 2], [1.0, 0.5])


def test_equal_selections_have_equal_bytes(written, tmp_path):
    write_selection(tmp_path / "again.parquet", read_selection(tmp_path, "hard", "d1"))
    assert (tmp_path / "again.parquet").read_bytes() == written.read_bytes()


def test_any_parquet_reader_gets_the_columns_in_the_order_of_the_ranks(written):
    assert pq.read_table(written).to_pylist()[0] == {"key": "g/s/b", "rank": 1, "score": 1.0, "why": "detour 2.8"}


def test_a_selection_is_named_or_its_file_is(written, tmp_path):
    store = open_store(tmp_path)
    assert len(read_selection(store, str(written), "d1")) == 2
    assert len(read_selection(store, "hard", "d1")) == 2
    assert selection_names(store) == ["hard"]
    assert selection_names(open_store(tmp_path / "selections")) == []


def test_a_selection_of_another_release_is_refused_with_both_digests(written, tmp_path):
    with pytest.raises(ConfigError, match=r"digest d1, but the release .* has digest d2; .*select again: wsm select"):
        read_selection(tmp_path, "hard", "d2")


def test_a_selection_that_is_not_there_is_refused_with_those_that_are(written, tmp_path):
    with pytest.raises(ConfigError, match=r"no selection at .*/easy\.parquet; it has hard; make one with `wsm select`"):
        read_selection(tmp_path, "easy", "d1")
    with pytest.raises(ConfigError, match=r"no selection at .*/other\.parquet; make one"):
        read_selection(tmp_path, str(tmp_path / "other.parquet"), "d1")


def content(one):
    columns = (one.keys.to_pylist(), one.scores.tolist(), one.why.to_pylist())
    return (one.name, one.release_digest, one.rule, one.command, *columns)


def test_no_changed_byte_changes_what_is_read(written):
    """Most are refused; some, such as the name of the program that wrote the file, mean nothing."""
    data, expected, refused = written.read_bytes(), content(selection()), 0
    for place in range(len(data)):
        changed = bytearray(data)
        changed[place] ^= 1
        try:
            assert content(parse_selection(bytes(changed), "x")) == expected, place
        except IntegrityError as error:
            assert "x must be a selection, but: " in str(error)  # noqa: PT017
            refused += 1
    assert refused > len(data) / 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda table: table.replace_schema_metadata(None),
            "wsm.selection in its metadata must say version 1, found None",
        ),
        (lambda table: table.slice(0, 1), "must have 2 rows"),
        (lambda table: table.drop(["why"]), "why: absent"),
        (lambda table: table.set_column(1, "rank", pa.array([2, 1])), "ranks must count from 1"),
        (lambda table: table.set_column(0, "key", pa.array(["g/s/a"] * 2)), "every clip must be listed once"),
    ],
)
def test_a_table_that_is_no_selection_is_refused(written, tmp_path, change, message):
    pq.write_table(change(pq.read_table(written)), tmp_path / "changed.parquet")
    with pytest.raises(IntegrityError, match=message):
        parse_selection((tmp_path / "changed.parquet").read_bytes(), "x")


def test_a_selection_of_another_version_asks_for_a_matching_wsm(written, tmp_path):
    table = pq.read_table(written)
    stated = table.schema.metadata[b"wsm.selection"].replace(b'"version":1', b'"version":2')
    pq.write_table(table.replace_schema_metadata({b"wsm.selection": stated}), tmp_path / "new.parquet")
    with pytest.raises(IntegrityError, match="must say version 1, found 2; use a matching wsm"):
        parse_selection((tmp_path / "new.parquet").read_bytes(), "x")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "a/b"}, "name of a selection"),
        ({"name": "hard.parquet"}, "name of a selection"),
        ({"keys": pa.array(["a", "a"])}, "listed once"),
        ({"keys": pa.array(["a", None])}, "listed once"),
        ({"scores": np.array([1.0, np.nan])}, "finite"),
        ({"scores": np.ones(3)}, "one length"),
    ],
)
def test_a_selection_that_contradicts_itself_is_a_bug_of_the_caller(changes, message):
    with pytest.raises(ValueError, match=message):
        selection(**changes)


def test_the_rows_of_a_selection_are_those_of_its_clips_in_the_order_of_the_index(tiny):
    release = open_release(tiny.folder)
    keys = release.index.texts("key")
    chosen = selection([keys[4], keys[1]], release_digest=release_digest(release.manifest))
    assert chosen.rows_of(release.index).tolist() == [1, 4]


def test_a_clip_that_the_release_does_not_have_is_named(tiny):
    release = open_release(tiny.folder)
    with pytest.raises(IntegrityError, match="lists 1 clips that its release does not have, such as g/s/lost"):
        selection([release.index.texts("key")[0], "g/s/lost"]).rows_of(release.index)


def test_many_clips_are_written_and_read_in_columns(tmp_path):
    many = selection([f"g_d435i/home_{n % 977:04d}/{n:07d}" for n in range(10**5)])
    write_selection(tmp_path / "many.parquet", many)
    found = read_selection(tmp_path, str(tmp_path / "many.parquet"), "d1")
    assert found.keys == many.keys


def test_with_its_index_a_changed_release_is_refused_with_the_clips_that_are_gone(tiny):
    release = open_release(tiny.folder)
    keys = release.index.texts("key")
    for found, words in (
        ([*keys[:2], "g/s/gone"], "and 1 of its 3 clips are gone, such as g/s/gone; read it"),
        (keys[:2], "and all 2 clips are still there; read it"),
    ):
        write_selection(tiny.folder / selection_path("hard"), selection(found))
        with pytest.raises(ConfigError, match=words):
            read_selection(release.store, "hard", release_digest(release.manifest), release.index)
