import numpy as np
import pytest

from wsm_data.access.release import open_release
from wsm_data.curation.audit.clip_labels import read_labels
from wsm_data.errors import IntegrityError
from wsm_data.geometry.transform import transforms_from_vectors


@pytest.fixture
def release(tiny):
    return open_release(tiny.folder)


def test_labels_are_those_of_the_whole_clip(release):
    row = release.index.row_at(2)
    clip, found = release.read_clip(row.key), read_labels(release, row)
    positions = (clip.meta.T_world_camera0_matrix @ transforms_from_vectors(clip.poses.astype(np.float64)))[:, :3, 3]
    floor = np.array([0, 0, clip.meta.camera_height_m])
    np.testing.assert_array_equal(found.outline_xy_m[[0, -1]], positions[[0, -1], :2])
    np.testing.assert_array_equal(found.start_m, positions[0] - floor)
    np.testing.assert_array_equal(found.goal_m, np.array(clip.meta.goal_world_m) - floor)
    assert found.expert_distance_m == clip.expert_distance[0]
    assert (found.map_digest, found.robot_radius_m) == (clip.meta.map_digest, clip.meta.robot_radius_m)


def test_padding_is_no_part_of_the_path(tiny, make_clip, tmp_path):
    clip = make_clip("synth_d435i/home_0001/000009", latents=4, padded_frames=5)
    tiny.pack(tmp_path / "padded", [clip], shard_bytes=1 << 20)
    release = open_release(tmp_path / "padded")
    found = read_labels(release, release.index.row_at(0))
    np.testing.assert_allclose(found.outline_xy_m[-1], clip.poses[7, :2], rtol=1e-6)  # frames 0 to 7 of 13


@pytest.mark.parametrize("name", ["poses", "expert_distance", "meta"])
def test_a_damaged_label_is_named(release, tiny, name):
    row = release.index.row_at(1)
    member = next(one for one in row.members if one.name == name)
    shard = tiny.folder / row.shard
    data = bytearray(shard.read_bytes())
    data[row.clip_offset + member.array_offset] ^= 1
    shard.write_bytes(bytes(data))
    with pytest.raises(IntegrityError, match=f"{row.shard}, clip {row.key}: the checksum of {member.file_name}"):
        read_labels(release, row)


def test_a_missing_shard_is_named(release, tiny):
    row = release.index.row_at(1)
    (tiny.folder / row.shard).unlink()
    with pytest.raises(IntegrityError, match=f"clip {row.key}: {row.shard} is missing from"):
        read_labels(release, row)
