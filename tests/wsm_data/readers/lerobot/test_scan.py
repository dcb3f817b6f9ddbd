import shutil
from dataclasses import replace

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.lerobot import scan
from wsm_data.readers.lerobot.reader import LEROBOT
from wsm_data.readers.lerobot.scan import episode_number, scan_episode, video_features


def test_the_number_of_an_episode_is_that_of_its_container(lerobot_root, dataset):
    containers = LEROBOT.find_containers(lerobot_root, dataset)
    assert [episode_number(one) for one in containers] == [0, 1]
    assert video_features(dataset) == ["observation.images.rgb", "observation.images.depth"]


def test_a_feature_of_intrinsics_comes_before_the_published_camera(lerobot_root, dataset, tmp_path):
    root = tmp_path / "drift"
    shutil.copytree(lerobot_root, root)
    for path in root.glob("data/**/*.parquet"):
        table = pq.read_table(path)
        pq.write_table(table.append_column("K", pa.array([[70.0, 71.0, 30.0, 22.0]] * len(table))), path)
    own = replace(dataset, features=replace(dataset.features, intrinsics="K"), cameras={})
    for container in LEROBOT.find_containers(root, own):
        (record,) = scan_episode(root, container, own, 3).records
        assert (record.intrinsics.fx, record.intrinsics.width) == (70.0, 64)


def test_a_published_camera_of_another_size_is_none(lerobot_root, dataset):
    camera = replace(dataset.cameras["camera"], width=128)
    container = LEROBOT.find_containers(lerobot_root, dataset)[0]
    with pytest.raises(DataError, match="64 x 48 px") as caught:
        scan_episode(lerobot_root, container, replace(dataset, cameras={"camera": camera}), 3)
    assert caught.value.reason is Reason.INTRINSICS_MISFIT


def test_a_video_that_is_missing_is_a_refusal_of_its_episode(lerobot_root, dataset, tmp_path):
    root = tmp_path / "drift"
    shutil.copytree(lerobot_root, root)
    containers = LEROBOT.find_containers(root, dataset)
    for path in root.glob("videos/**/*.mp4"):
        path.unlink()
    with pytest.raises(DataError) as caught:
        scan_episode(root, containers[0], dataset, 3)
    assert caught.value.reason is Reason.FILE_UNREADABLE


def test_the_table_of_episodes_is_read_once_and_again_when_it_was_touched(lerobot_root, dataset, tmp_path, monkeypatch):
    root = shutil.copytree(lerobot_root, tmp_path / "drift")
    containers, read, places = LEROBOT.find_containers(root, dataset), [], scan.read_places
    monkeypatch.setattr(scan, "read_places", lambda *args: read.append(1) or places(*args))
    for container in containers:
        scan_episode(root, container, dataset, 3)
    assert len(read) == 1
    (root / "meta" / "notes.txt").write_text("touched")
    scan_episode(root, containers[0], dataset, 3)
    assert len(read) == 2
