import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.curation.quotas import Limits, Quota, QuotaConfig, column_codes, quota_table
from wsm_data.errors import ConfigError

PLACES = ["a/zed", "a/d435i", "a/d435i", "b/zed", "b/d435i", "b/d435i", "c/d435i", "c/d435i", "c/d435i", "c/d435i"]


def bounds(table):
    return {name: (least, most) for name, least, most in zip(table.names, table.least, table.most, strict=True)}


def test_shares_become_numbers_of_clips_and_single_places_have_bounds_of_their_own(make_index):
    config = QuotaConfig(
        scene=Quota(at_most=0.5, named={"g/c": Limits(at_least=1, at_most=1)}), camera=Quota(at_least=0.3)
    )
    found = bounds(quota_table(config, make_index(PLACES), 5))
    assert found["scene g/a"] == (0, 2)  # half of 5, rounded down
    assert found["scene g/c"] == (1, 1)
    assert found["camera zed"] == (2, 5)  # 0.3 of 5, rounded up


def test_a_share_that_is_a_whole_number_of_clips_is_not_moved_by_rounding(make_index):
    config = QuotaConfig(camera=Quota(named={"d435i": Limits(at_least=0.7, at_most=0.7)}))
    assert bounds(quota_table(config, make_index(PLACES * 2), 10))["camera d435i"] == (7, 7)


def test_codes_say_the_place_of_every_clip(make_index):
    table = quota_table(QuotaConfig(), make_index(PLACES), 5)
    names = np.array(table.names)[table.codes]
    assert names[:, 3].tolist() == ["scene g/b", "group g_zed", "camera zed"]


@given(st.lists(st.sampled_from("abcd"), min_size=1, max_size=20), st.integers(1, 4))
def test_values_that_no_row_has_are_no_values(letters, pieces):
    whole = pa.chunked_array([pa.array([*letters, "unused"]).dictionary_encode()])
    rows = whole.slice(0, len(letters))
    column = pa.chunked_array([chunk for piece in np.array_split(np.arange(len(letters)), pieces)
                               for chunk in rows.take(pa.array(piece)).chunks], whole.type)  # fmt: skip
    values, numbers = column_codes(column)
    assert [values[number] for number in numbers] == letters
    assert sorted(values) == sorted(set(letters))


@pytest.mark.parametrize(
    ("config", "count", "message"),
    [
        (QuotaConfig(camera=Quota(at_least=3)), 5, "camera zed cannot be met: at least 3 .* of 2 candidates"),
        (QuotaConfig(scene=Quota(at_least=2)), 5, "quotas.scene cannot be met: .* at least 6 clips together, and 5"),
        (QuotaConfig(scene=Quota(at_most=1)), 5, "quotas.scene cannot be met: .* at most 3 clips together, and 5"),
        (
            QuotaConfig(group=Quota(at_least=2, at_most=1)),
            5,
            "group g_.* cannot be met: at least 2 clips and at most 1",
        ),
        (QuotaConfig(camera=Quota(named={"zde": Limits()})), 5, "quotas.camera.named names 'zde'.*did you mean zed"),
    ],
)
def test_quotas_that_cannot_be_met_are_refused_by_their_name(make_index, config, count, message):
    with pytest.raises(ConfigError, match=message):
        quota_table(config, make_index(PLACES), count)


@pytest.mark.parametrize("value", [-0.1, 1.5])
def test_a_bound_is_a_share_or_a_whole_number(value):
    with pytest.raises(ValueError, match="a share below 1 or a whole number"):
        Limits(at_least=value)


@pytest.mark.parametrize("side", ["at_least", "at_most"])
@pytest.mark.parametrize("bound", [float("nan"), float("inf"), -0.1, 1.5])
def test_a_bound_is_a_share_or_a_whole_number_of_clips(side, bound):
    with pytest.raises(ValueError, match=f"{side} must be a share below 1 or a whole number of clips, found {bound}"):
        Limits(**{side: bound})


def test_one_is_one_clip_and_no_share(make_index):
    found = bounds(quota_table(QuotaConfig(scene=Quota(at_most=1.0, named={"g/c": Limits()})), make_index(PLACES), 5))
    assert (found["scene g/a"], found["scene g/c"]) == ((0, 1), (0, 5))
