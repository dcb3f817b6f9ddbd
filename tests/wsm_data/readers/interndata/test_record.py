import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.interndata.contents import FolderContents, ImageFacts
from wsm_data.readers.interndata.record import build_record, episode_numbers
from wsm_data.readers.interndata.table import EpisodeTable
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.depth import DepthEncoding
from wsm_data.schema.identity import EpisodeId

ID = EpisodeId("gibson_zed", "scene", "000004")


def folder_of(T_mount, poses):
    """Contents of one episode, number 4, without any file behind it."""
    K = np.array([[20.0, 0, 15.5], [0, 20, 11.5], [0, 0, 1]])
    images = {(4, t): ImageFacts(f"{t}", (32, 24), f"{t:032x}", None) for t in range(len(poses))}
    table = EpisodeTable(K=K, T_mount=T_mount, T_world_stored=poses)
    return FolderContents(tables={4: table}, rgb=dict(images), depth=dict(images))


def dataset_of(axes):
    encoding = DepthEncoding(metres_per_unit=1e-4, invalid_codes=(0,))
    return DatasetManifest(name="d", licence="l", depth=encoding, camera_axes=axes)


@pytest.mark.parametrize("pitch_deg", [0.0, 15.0, 30.0, -10.0])
def test_pitch_and_height_are_read_from_the_mount_of_the_source(pitch_deg):
    """Rx(90 deg - pitch), z = height in OpenGL axes; the same mount in OpenCV axes is that times diag(1, -1, -1)."""
    angle = np.deg2rad(90 - pitch_deg)
    opengl = np.eye(4)
    opengl[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    opengl[2, 3] = 0.7
    for axes, mount in (("opengl", opengl), ("opencv", opengl @ np.diag([1.0, -1, -1, 1]))):
        record, _ = build_record(ID, "c", folder_of(mount, np.stack([mount] * 5)), 4, dataset_of(axes))
        assert np.rad2deg(record.camera_pitch_rad) == pytest.approx(pitch_deg, abs=1e-9)
        assert record.camera_height_m == 0.7
        assert record.floor_z_m == 0.0
        forward = record.T_world_camera[0, :3, 2]
        assert forward == pytest.approx([0, np.cos(np.deg2rad(pitch_deg)), -np.sin(np.deg2rad(pitch_deg))], abs=1e-12)


def test_images_of_an_episode_without_a_table_make_it_known():
    folder = folder_of(np.eye(4), np.stack([np.eye(4)] * 5))
    folder.rgb[9, 0] = folder.rgb[4, 0]
    assert episode_numbers(folder, in_trajectory=False, alone=True) == [4, 9]
    with pytest.raises(DataError) as caught:
        build_record(ID, "c", folder, 9, dataset_of("opengl"))
    assert caught.value.reason is Reason.TABLE_UNREADABLE


@pytest.mark.parametrize(
    ("in_trajectory", "alone", "expected"), [(False, True, [4, 5, 6]), (False, False, [4, 5, 6]), (True, True, [4])]
)
def test_episodes_that_are_only_named_are_known_in_scenes(in_trajectory, alone, expected):
    folder = folder_of(np.eye(4), np.stack([np.eye(4)] * 5))
    folder.lengths.update({6: 5, 5: 5})
    assert episode_numbers(folder, in_trajectory=in_trajectory, alone=alone) == expected


@pytest.mark.parametrize(
    ("in_trajectory", "alone", "expected"), [(False, True, [5, 6]), (False, False, []), (True, True, [5])]
)
def test_a_folder_of_names_alone_speaks_for_itself_and_not_for_other_folders(in_trajectory, alone, expected):
    folder = FolderContents(lengths={6: 5, 5: 5})
    assert episode_numbers(folder, in_trajectory=in_trajectory, alone=alone) == expected
