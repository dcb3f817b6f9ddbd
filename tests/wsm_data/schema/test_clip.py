"""A clip is accepted whole or refused with the name of the field that does not fit."""

from dataclasses import replace

import numpy as np
import pytest

from wsm_data.schema.clip import DEPTH_MEMBERS, MEMBERS, UNREACHABLE_MM, Clip


def test_a_valid_clip_knows_its_lengths(clip_fields):
    clip = Clip(**clip_fields)
    assert (clip.frame_count, clip.latent_count) == (9, 3)
    assert clip.intrinsics == clip.meta.intrinsics


def test_arrays_come_in_the_stored_order_and_are_the_ones_given(clip_fields):
    arrays = Clip(**clip_fields).arrays()
    assert list(arrays) == list(MEMBERS)
    for name, array in arrays.items():
        assert np.shares_memory(array, clip_fields[name])


def test_the_arrays_of_a_clip_cannot_be_written_to(clip_fields):
    for array in Clip(**clip_fields).arrays().values():
        assert not array.flags.writeable


def test_a_clip_of_one_frame_is_one_latent(clip_fields):
    single = {name: clip_fields[name][:1] for name in MEMBERS if name not in ("occupancy", "geodesic_mm")}
    meta = replace(clip_fields["meta"], frames=1, padded_frames=0)
    assert Clip(**{**clip_fields, **single, "meta": meta}).latent_count == 1


@pytest.mark.parametrize("name", MEMBERS)
def test_another_dtype_is_refused_by_name(clip_fields, name):
    other = np.float64 if clip_fields[name].dtype.kind == "f" else np.int64
    with pytest.raises(ValueError, match=f"^{name} must be "):
        Clip(**{**clip_fields, name: clip_fields[name].astype(other)})


@pytest.mark.parametrize("name", MEMBERS)
def test_another_number_of_axes_is_refused_by_name(clip_fields, name):
    with pytest.raises(ValueError, match=f"^{name} must be "):
        Clip(**{**clip_fields, name: clip_fields[name][None]})


@pytest.mark.parametrize("name", [name for name, (dtype, _) in MEMBERS.items() if dtype.kind == "f"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused_by_name(clip_fields, name, bad):
    array = clip_fields[name].copy()
    array.flat[-1] = bad
    with pytest.raises(ValueError, match=f"^{name} must be finite, found {bad}"):
        Clip(**{**clip_fields, name: array})


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("depth_latent", (2, 48, 12, 20)),
        ("depth_latent", (3, 16, 12, 20)),
        ("depth_valid", (3, 24, 40)),
        ("poses", (9, 6)),
        ("geodesic_mm", (30, 41)),
        ("expert_distance", (8,)),
    ],
)
def test_an_axis_that_disagrees_with_an_earlier_member_is_refused_by_name(clip_fields, name, shape):
    with pytest.raises(ValueError, match=f"^{name} must be "):
        Clip(**{**clip_fields, name: np.zeros(shape, MEMBERS[name][0])})


@pytest.mark.parametrize("frames", [0, 1, 8, 10, 13])
def test_raw_frames_that_do_not_fit_the_latents_are_refused(clip_fields, frames):
    poses = np.zeros((frames, 7), np.float32)
    poses[:, 3] = 1
    fields = {**clip_fields, "poses": poses, "expert_distance": np.zeros(frames, np.float32)}
    with pytest.raises(ValueError, match=rf"poses of T = 1 \+ 4 \(F - 1\) raw frames, found F = 3, T = {frames}"):
        Clip(**fields)


def test_a_frame_count_in_the_meta_that_is_not_the_clips_is_refused(clip_fields):
    with pytest.raises(ValueError, match=r"^meta\.frames must be the T = 9 rows of poses, found 13"):
        Clip(**{**clip_fields, "meta": replace(clip_fields["meta"], frames=13)})


def test_poses_must_start_with_the_identity(clip_fields):
    poses = clip_fields["poses"].copy()
    poses[0, 0] = 1e-6
    with pytest.raises(ValueError, match=r"^poses must start with the identity"):
        Clip(**{**clip_fields, "poses": poses})


def test_a_quaternion_that_is_not_unit_is_refused_with_its_row(clip_fields):
    poses = clip_fields["poses"].copy()
    poses[4, 3] = 1.0001
    with pytest.raises(ValueError, match=r"^poses must hold unit quaternions, found one off by 1\.00e-04 in row 4"):
        Clip(**{**clip_fields, "poses": poses})


def test_a_quaternion_with_negative_w_is_refused_with_its_row(clip_fields):
    poses = clip_fields["poses"].copy()
    poses[5, 3] = -1
    with pytest.raises(ValueError, match=r"^poses must hold quaternions of w >= 0, found w < 0 in row 5"):
        Clip(**{**clip_fields, "poses": poses})


def test_quaternions_rounded_to_float32_are_unit_enough(clip_fields):
    quaternions = np.random.default_rng(3).normal(size=(1000, 8, 4))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    quaternions *= np.where(quaternions[..., :1] < 0, -1, 1)
    for eight in quaternions[:50]:
        poses = clip_fields["poses"].copy()
        poses[1:, 3:] = eight
        Clip(**{**clip_fields, "poses": poses})
    assert np.abs(np.linalg.norm(quaternions.astype(np.float32).astype(np.float64), axis=-1) - 1).max() < 1e-6


def test_the_member_table_is_the_one_of_the_format():
    table = {name: f"{dtype} {axes}" for name, (dtype, axes) in MEMBERS.items()}
    assert table == {
        "rgb_latent": "float16 FChw",
        "depth_latent": "float16 FChw",
        "depth_valid": "uint8 Fhw",
        "poses": "float32 T7",
        "occupancy": "uint8 YX",
        "geodesic_mm": "uint16 YX",
        "expert_distance": "float32 T",
    }
    assert np.iinfo(MEMBERS["geodesic_mm"][0]).max == UNREACHABLE_MM


def test_depth_is_there_with_its_validity_or_not_at_all(clip_fields):
    bare = Clip(**{name: value for name, value in clip_fields.items() if name not in DEPTH_MEMBERS})
    assert not bare.has_depth
    assert list(bare.arrays()) == [name for name in MEMBERS if name not in DEPTH_MEMBERS]
    with pytest.raises(ValueError, match="must be there both, or neither"):
        Clip(**{**clip_fields, "depth_valid": None})


def test_the_poses_of_a_latent_are_those_of_its_raw_frames(clip_fields):
    clip = Clip(**clip_fields)
    poses = clip.latent_poses
    assert poses.shape == (3, 4, 7)
    np.testing.assert_array_equal(poses[0], np.tile(clip.poses[0], (4, 1)))  # the identity, four times
    np.testing.assert_array_equal(poses[1:].reshape(8, 7), clip.poses[1:])


def test_the_map_of_a_clip_stands_in_the_world(clip_fields):
    clip = Clip(**{**clip_fields, "meta": replace(clip_fields["meta"], map_origin_cell=(-4, 7))})
    assert clip.grid.origin_xy_m == (-4 * clip.meta.map_resolution_m, 7 * clip.meta.map_resolution_m)
    np.testing.assert_array_equal(clip.grid.cells, clip.occupancy)
