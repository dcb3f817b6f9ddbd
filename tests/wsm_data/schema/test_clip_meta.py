"""Provenance survives JSON to the bit, and a record of another shape is refused."""

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.clip_meta import CLIP_FORMAT_VERSION, ClipMeta

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


def round_trip(meta):
    return ClipMeta.from_json(json.loads(json.dumps(meta.to_json())))


def test_a_meta_comes_back_equal(meta_fields):
    meta = ClipMeta(**meta_fields)
    assert round_trip(meta) == meta


def test_a_meta_comes_back_with_the_same_types(meta_fields):
    back = round_trip(ClipMeta(**meta_fields))
    for name, value in meta_fields.items():
        assert type(getattr(back, name)) is type(value), name


@given(matrix=st.lists(NUMBERS, min_size=16, max_size=16), goal=st.tuples(NUMBERS, NUMBERS, NUMBERS))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the fixture's fields are not changed
def test_every_float_comes_back_to_the_bit(meta_fields, matrix, goal):
    rows = tuple(tuple(matrix[i : i + 4]) for i in range(0, 16, 4))
    back = round_trip(ClipMeta(**{**meta_fields, "T_world_camera0": rows, "goal_world_m": goal}))
    assert [number.hex() for row in back.T_world_camera0 for number in row] == [number.hex() for number in matrix]
    assert [number.hex() for number in back.goal_world_m] == [number.hex() for number in goal]


def test_writing_it_again_gives_the_same_bytes(meta_fields):
    text = canonical_json(ClipMeta(**meta_fields).to_json())
    assert canonical_json(ClipMeta.from_json(json.loads(text)).to_json()) == text


def test_the_first_camera_is_given_as_a_matrix(meta_fields):
    T = ClipMeta(**meta_fields).T_world_camera0_matrix
    assert T.dtype == np.float64
    assert T.tolist() == [list(row) for row in meta_fields["T_world_camera0"]]


@pytest.mark.parametrize("version", [0, CLIP_FORMAT_VERSION + 1, "1", None])
def test_another_format_version_is_refused_before_anything_else(meta_fields, version):
    record = {"format_version": version, "some_later_field": 1}
    with pytest.raises(ValueError, match=rf"format_version must be {CLIP_FORMAT_VERSION}, found {version!r}"):
        ClipMeta.from_json(record)


def test_a_missing_field_is_named(meta_fields):
    record = ClipMeta(**meta_fields).to_json()
    del record["goal_radius_m"]
    with pytest.raises(ValueError, match="goal_radius_m"):
        ClipMeta.from_json(record)


def test_an_unknown_field_is_named(meta_fields):
    record = {**ClipMeta(**meta_fields).to_json(), "speed_mps": 1.0}
    with pytest.raises(ValueError, match="speed_mps"):
        ClipMeta.from_json(record)


@pytest.mark.parametrize(
    ("part", "kind"), [("id", "EpisodeId"), ("intrinsics", "Intrinsics"), ("depth_range", "DepthRange")]
)
def test_a_part_with_other_fields_is_refused_by_its_kind(meta_fields, part, kind):
    record = ClipMeta(**meta_fields).to_json()
    record[part] = {"wrong": 1}
    with pytest.raises(ValueError, match=rf"^meta\.json: {kind} must have exactly the fields .* found \['wrong'\]"):
        ClipMeta.from_json(record)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("map_from", "guess", "^map_from must be 'cloud' or 'depth', found 'guess'"),
        ("padded_frames", -1, r"^padded_frames must lie in \[0, frames = 9\), found -1"),
        ("padded_frames", 9, r"^padded_frames must lie in \[0, frames = 9\), found 9"),
        ("T_world_camera0", ((1.0, 0.0, 0.0, 0.0),) * 3, "^T_world_camera0 must be 4 x 4"),
        ("T_world_camera0", ((1.0, 0.0, 0.0),) * 4, "^T_world_camera0 must be 4 x 4"),
    ],
)
def test_a_value_that_cannot_be_is_refused_by_name(meta_fields, field, value, message):
    with pytest.raises(ValueError, match=message):
        ClipMeta(**{**meta_fields, field: value})
