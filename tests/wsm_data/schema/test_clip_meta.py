"""Provenance survives JSON to the bit, and a record of another shape is refused."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wsm_data.files.json_values import to_json
from wsm_data.files.jsonlines import canonical_json
from wsm_data.schema.clip_meta import CLIP_FORMAT_VERSION, ClipMeta, meta_bytes, parse_meta

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


def round_trip(meta):
    return parse_meta(meta_bytes(meta))


def test_a_meta_comes_back_equal(meta_fields):
    meta = ClipMeta(**meta_fields)
    assert round_trip(meta) == meta


def test_a_meta_comes_back_with_the_same_types(meta_fields):
    back = round_trip(ClipMeta(**meta_fields))
    for name, value in meta_fields.items():
        assert type(getattr(back, name)) is type(value), name


def test_recorded_frames_leave_the_padding_out(meta_fields):
    assert ClipMeta(**{**meta_fields, "frames": 9, "padded_frames": 2}).recorded_frames == 7


@given(matrix=st.lists(NUMBERS, min_size=16, max_size=16), goal=st.tuples(NUMBERS, NUMBERS, NUMBERS))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the fixture's fields are not changed
def test_every_float_comes_back_to_the_bit(meta_fields, matrix, goal):
    rows = tuple(tuple(matrix[i : i + 4]) for i in range(0, 16, 4))
    back = round_trip(ClipMeta(**{**meta_fields, "T_world_camera0": rows, "goal_world_m": goal}))
    assert [number.hex() for row in back.T_world_camera0 for number in row] == [number.hex() for number in matrix]
    assert [number.hex() for number in back.goal_world_m] == [number.hex() for number in goal]


def test_writing_it_again_gives_the_same_bytes(meta_fields):
    data = meta_bytes(ClipMeta(**meta_fields))
    assert meta_bytes(parse_meta(data)) == data


def test_the_first_camera_is_given_as_a_matrix(meta_fields):
    T = ClipMeta(**meta_fields).T_world_camera0_matrix
    assert T.dtype == np.float64
    assert T.tolist() == [list(row) for row in meta_fields["T_world_camera0"]]


@pytest.mark.parametrize("version", [0, CLIP_FORMAT_VERSION + 1, "1", None])
def test_another_format_version_is_refused_before_anything_else(meta_fields, version):
    record = {"format_version": version, "some_later_field": 1}
    with pytest.raises(ValueError, match=rf"format_version must be {CLIP_FORMAT_VERSION}, found {version!r}"):
        parse_meta(canonical_json(record).encode())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"goal_radius_m": None}, "goal_radius_m takes a number"),
        ({"speed_mps": 1.0}, "unknown key speed_mps"),
        ({"id": {"wrong": 1}}, r"unknown key id\.wrong"),
        ({"intrinsics": {}}, r"intrinsics\.fx has no default"),
        ({"notes": "abc"}, "notes takes a list"),
    ],
)
def test_a_field_that_is_missing_unknown_or_of_another_type_is_named(meta_fields, change, words):
    with pytest.raises(ValueError, match=words):
        parse_meta(canonical_json({**to_json(ClipMeta(**meta_fields)), **change}).encode())


@pytest.mark.parametrize("data", [b"", b"[]"])
def test_what_is_no_json_object_is_refused(data):
    with pytest.raises(ValueError, match=r"Expecting value|format_version"):
        parse_meta(data)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("map_from", "guess", "^map_from must be 'cloud', 'depth' or 'path', found 'guess'"),
        ("padded_frames", -1, r"^padded_frames must lie in \[0, frames = 9\), found -1"),
        ("padded_frames", 9, r"^padded_frames must lie in \[0, frames = 9\), found 9"),
        ("T_world_camera0", ((1.0, 0.0, 0.0, 0.0),) * 3, "^T_world_camera0 must be 4 x 4"),
        ("T_world_camera0", ((1.0, 0.0, 0.0),) * 4, "^T_world_camera0 must be 4 x 4"),
    ],
)
def test_a_value_that_cannot_be_is_refused_by_name(meta_fields, field, value, message):
    with pytest.raises(ValueError, match=message):
        ClipMeta(**{**meta_fields, field: value})
