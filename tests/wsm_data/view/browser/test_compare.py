from dataclasses import replace

import pytest

from wsm_data.errors import ConfigError
from wsm_data.shards.index.row import SCHEMA
from wsm_data.shards.index.table import IndexTable
from wsm_data.view.browser.compare import Comparison


@pytest.fixture(scope="module")
def comparison(made, release, tmp_path_factory) -> Comparison:
    """The right release lacks the last two clips, has one of its own, and one of another split."""
    units = dict(list(made.units.items())[:-2]) | {"synth_zed/home_0008/000000": "train"}
    units["synth_zed/home_0001/000000"] = "train"
    return Comparison(release, made.release(tmp_path_factory.mktemp("other"), units))


def test_clips_are_counted_by_where_they_are(comparison):
    about = comparison.about()
    assert about["counts"] == {"left": 2, "right": 1, "changed": 1, "same": 3}
    left, right = (dict(one["facts"]) for one in about["releases"])
    assert (left["clips"], right["clips"], left["codec"] == right["codec"]) == ("6", "5", True)


@pytest.mark.parametrize(
    ("where", "keys"),
    [
        ("left", ["synth_zed/home_0001/000005", "synth_zed/home_0003/000004"]),
        ("right", ["synth_zed/home_0008/000000"]),
        ("changed", ["synth_zed/home_0001/000000"]),
    ],
)
def test_clips_are_listed_by_where_they_are(comparison, where, keys):
    found = comparison.listed(where, "", 0, 10)
    assert (found["total"], [clip["key"] for clip in found["clips"]]) == (len(keys), keys)
    assert comparison.listed(where, "HOME_0008", 0, 10)["total"] == (where == "right")


def test_what_changed_is_said(comparison):
    assert comparison.listed("changed", "", 0, 1)["clips"][0]["changed"] == ["split: test → train"]


def test_another_trajectory_under_the_same_key_is_a_change(release):
    table = release.index.columns(SCHEMA.names)
    digests = ["another", *table["source_digest"].to_pylist()[1:]]
    changed = table.set_column(table.schema.get_field_index("source_digest"), "source_digest", [digests])
    comparison = Comparison(release, replace(release, index=IndexTable(changed)))
    assert comparison.about()["counts"] == {"left": 0, "right": 0, "changed": 1, "same": 5}
    assert comparison.listed("changed", "", 0, 1)["clips"][0]["changed"] == ["another trajectory"]


def test_a_place_that_is_none_is_refused(comparison):
    with pytest.raises(ConfigError, match="where must be one of changed, left, right, same, found 'up'"):
        comparison.listed("up", "", 0, 1)
