import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from wsm_data.errors import ConfigError, DataError, IntegrityError, Reason
from wsm_data.readers.frames_digest import ABSENT
from wsm_data.readers.lerobot.reader import LEROBOT
from wsm_data.schema.source.lerobot_features import PoseForm


def scans(root, dataset):
    containers = LEROBOT.find_containers(root, dataset)
    return [(container, LEROBOT.scan(root, container, dataset, 2)) for container in containers]


def test_what_was_written_comes_back_in_both_versions(lerobot_root, walks, dataset):
    for number, (container, found) in enumerate(scans(lerobot_root, dataset)):
        (record,) = found.records
        assert record.id.text == f"lerobot_camera/drift_{number:06d}/000000"
        assert np.abs(record.T_world_camera - np.array(walks[number].T_world_camera)).max() < 1e-7  # float32 there
        assert record.intrinsics.fy == 61.0
        assert record.camera_height_m == pytest.approx(0.8, abs=1e-7)
        assert [index for index, _ in found.depth_samples[record.id.text]] == list(range(0, record.frame_count, 2))
        ((_, images),) = LEROBOT.iter_frames(lerobot_root, container, dataset, found.records)
        for colour, raw, rgb, depth_m in zip(
            images.rgb, images.depth, walks[number].rgb, walks[number].depth_m, strict=True
        ):
            assert np.abs(colour.astype(int) - rgb).mean() < 3  # the video is lossy
            measured = (depth_m > 0.02) & (depth_m < 9.98)
            error_m = np.abs(raw * dataset.depth.metres_per_unit - depth_m)[measured]
            assert error_m.max() < 0.0025  # half a step at 10 m: 13.5 m x log(13.5 / 3.51) / 4095 / 2
            assert (raw[depth_m > 10.01] == 0).all()


def test_without_a_depth_feature_frames_have_none(lerobot_root, dataset):
    bare = replace(dataset, features=replace(dataset.features, depth=""))
    for container, found in scans(lerobot_root, bare):
        assert set(found.records[0].depth_members) == {ABSENT}
        ((_, images),) = LEROBOT.iter_frames(lerobot_root, container, bare, found.records)
        assert set(images.depth) == {None}


def test_thinning_keeps_the_frames_of_the_right_times(lerobot_root, walks, dataset):
    thin = replace(dataset, motion=replace(dataset.motion, min_step_m=0.15))
    container, found = scans(lerobot_root, thin)[1]
    assert found.records[0].rgb_members == tuple(f"observation.images.rgb@{frame:06d}" for frame in range(0, 9, 2))
    ((_, images),) = LEROBOT.iter_frames(lerobot_root, container, thin, found.records)
    for colour, rgb in zip(images.rgb, walks[1].rgb[::2], strict=True):
        assert np.abs(colour.astype(int) - rgb).mean() < 3


@pytest.mark.parametrize(
    ("features", "reason", "said"),
    [
        ({"rgb": "observation.images.wrist"}, Reason.SEQUENCE_UNREADABLE, "its videos are observation.images.rgb"),
        ({"pose": "observation.state"}, Reason.TABLE_MISSING_COLUMN, "must have the features observation.state"),
        ({"pose_form": PoseForm.XYZ_WXYZ}, Reason.TABLE_BAD_SHAPE, "must hold 7 numbers in every row, found .16"),
        ({"camera": "other"}, Reason.INTRINSICS_MISFIT, "a published camera 'other'"),
        ({"depth": "observation.images.rgb"}, Reason.SEQUENCE_UNREADABLE, "is_depth_map"),
    ],
)
def test_a_manifest_that_names_another_thing_is_told_what_is_there(lerobot_root, dataset, features, reason, said):
    wrong = replace(dataset, features=replace(dataset.features, **features))
    container = LEROBOT.find_containers(lerobot_root, wrong)[0]
    (refusal,) = refusals_of(lerobot_root, container, wrong)
    assert refusal[0] is reason
    assert re.search(said, refusal[1])


def refusals_of(root, container, dataset):
    """Reason and message of what is refused, the episode as a whole or its one trajectory."""
    try:
        return [(one.reason, one.message) for one in LEROBOT.scan(root, container, dataset, 2).refusals]
    except DataError as error:
        return [(error.reason, error.message)]


def test_files_that_changed_after_the_first_pass_are_noticed(lerobot_root, dataset, tmp_path):
    root = tmp_path / "drift"
    shutil.copytree(lerobot_root, root)
    container, found = scans(root, dataset)[0]
    (video,) = sorted((root / "videos").glob("**/observation.images.rgb/**/*.mp4"))[:1]
    data = bytearray(video.read_bytes())
    at = data.index(b"mdat") + 800
    data[at] ^= 1
    video.write_bytes(data)
    with pytest.raises(IntegrityError, match="changed since"):
        list(LEROBOT.iter_frames(root, container, dataset, found.records))


def test_an_episode_whose_files_are_touched_has_another_signature(lerobot_root, dataset, tmp_path):
    root = tmp_path / "drift"
    shutil.copytree(lerobot_root, root)
    before = [one.signature for one in LEROBOT.find_containers(root, dataset)]
    (root / "meta" / "info.json").write_text(json.dumps(json.loads((root / "meta" / "info.json").read_text())))
    assert not set(before) & {one.signature for one in LEROBOT.find_containers(root, dataset)}


def test_a_folder_that_is_no_data_set_says_what_was_looked_for(tmp_path, dataset):
    with pytest.raises(ConfigError, match=r"meta/info\.json"):
        LEROBOT.find_containers(tmp_path, dataset)
