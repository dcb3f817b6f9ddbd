import json

import cv2
import numpy as np
import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.schema.episode import EpisodeRecord


def content(record: EpisodeRecord) -> dict[str, object]:
    """All of a record but the names of its container and files."""
    return {
        "id": record.id.text,
        "poses": record.T_world_camera.tobytes(),
        "intrinsics": record.intrinsics,
        "height": record.camera_height_m,
        "pitch": record.camera_pitch_rad,
        "digests": (record.frames_digest, record.content_digest),
        "notes": record.notes,
    }


def only_refusal(scan, reason: Reason, unit: str = "gibson_d435i/Acker.ville/000000"):
    """The one refusal of a scan; every other episode went on."""
    (refusal,) = scan.refusals
    assert (refusal.reason, refusal.unit) == (reason, unit)
    return refusal


@pytest.mark.parametrize("nested", [True, False])
def test_three_layouts_hold_the_same_records(build, tmp_path, scan_all, nested):
    episodes = {3: build.episode(3), 12: build.episode(12, frames=12)}
    reference = None
    for prefixed in (True, False):
        files = build.scene_files(episodes, nested=nested, prefixed=prefixed)
        build.write_archive(tmp_path / f"archive{prefixed}", files)
        build.write_scene_folder(tmp_path / f"folder{prefixed}", files)
    trajectories = {"trajectory_03": episodes[3], "trajectory_12": episodes[12]}
    files_of = {name: build.trajectory_files(episode, nested=nested) for name, episode in trajectories.items()}
    build.write_trajectories(tmp_path / "trajectories", files_of)
    flat = build.scene_files(episodes, nested=not nested)
    build.write_archive(tmp_path / "other_nesting", flat)
    inside = {f"{name}/{file}": data for name, files in files_of.items() for file, data in files.items()}
    build.write_archive(tmp_path / "archive_of_trajectories", inside)
    for source in sorted(tmp_path.iterdir()):
        scans = scan_all(source).values()
        found = [content(record) for scan in scans for record in scan.records]
        assert [record["id"][-6:] for record in found] == ["000003", "000012"], source
        assert not any(scan.refusals for scan in scans)
        reference = reference or found
        assert found == reference, source


def test_a_record_says_what_was_stored_in_the_projects_axes(build, scan_scene):
    episode = build.episode(0, height_m=0.8, pitch_deg=20)
    scan = scan_scene(build.scene_files({0: episode}))
    (record,) = scan.records
    opencv = episode.poses.astype(np.float64) @ np.diag([1.0, -1, -1, 1])
    assert np.array_equal(record.T_world_camera, opencv)  # float32 as stored: no rounding, no re-orthonormalising
    assert record.camera_height_m == np.float32(0.8)
    assert np.rad2deg(record.camera_pitch_rad) == pytest.approx(20, abs=1e-5)  # float32 sine and cosine
    assert record.T_world_camera[0, 2, 2] == pytest.approx(-np.sin(np.deg2rad(20)), abs=1e-6)  # looks down
    assert (record.intrinsics.fx, record.intrinsics.width, record.intrinsics.height) == (24, build.width, build.height)
    assert record.id.text == "gibson_d435i/Acker.ville/000000"
    assert record.rgb_members[3] == f"{build.rgb_folder}/episode_000000_003.jpg"
    assert sum(record.frame_count for record in scan.records) == 7
    assert scan.cloud is not None
    assert len(scan.cloud.xyz_m) == 50
    assert scan.depth_samples == {}


def test_images_are_in_the_order_of_their_numbers_and_not_of_their_names(build, tmp_path, scan_all):
    build.write_trajectories(tmp_path, {"trajectory_00": build.trajectory_files(build.episode(0, frames=12))})
    ((record,),) = (scan.records for scan in scan_all().values())
    assert [name.rsplit("/", 1)[1] for name in record.rgb_members] == [f"{t}.jpg" for t in range(12)]


def test_every_chunk_folder_is_read(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    moved = {
        name.replace("chunk-000", "chunk-001") if "_000001" in name else name: data for name, data in files.items()
    }
    scan = scan_scene(moved)
    assert [record.id.episode for record in scan.records] == ["000000", "000001"]
    assert "chunk-001" in scan.records[1].rgb_members[0]


def test_one_changed_bit_of_an_image_or_a_pose_changes_the_digests(build, tmp_path, scan_all):
    digests = set()
    for name in ("same", "image", "pose", "mount"):
        episode = build.episode(0)
        if name == "image":
            episode.rgb[2] = episode.rgb[3]
        elif name == "pose":
            episode.poses[1, 0, 3] += 1e-3
        elif name == "mount":
            episode.mount[2, 3] += 1e-3
        build.write_archive(tmp_path / name, build.scene_files({0: episode}))
        ((record,),) = (scan.records for scan in scan_all(tmp_path / name).values())
        digests.add((record.frames_digest, record.content_digest))
    assert len({content for _, content in digests}) == 4
    assert len({frames for frames, _ in digests}) == 2


def break_image(build, kind, change):
    """Files of a scene of two episodes, one image of the first changed."""
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    folder, ending = (build.rgb_folder, "jpg") if kind == "rgb" else (build.depth_folder, "png")
    name = f"{folder}/episode_000000_003.{ending}"
    files[name] = change(files[name])
    return files, name


@pytest.mark.parametrize("kind", ["rgb", "depth"])
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda data: b"", Reason.FRAME_EMPTY),
        (lambda data: data[:-100], Reason.FRAME_TRUNCATED),
        (lambda data: data[:3], Reason.FRAME_TRUNCATED),
        (lambda data: b"<html>not found</html>", Reason.FRAME_UNDECODABLE),
    ],
)
def test_a_damaged_image_refuses_its_episode_alone(build, scan_scene, kind, change, reason):
    files, name = break_image(build, kind, change)
    scan = scan_scene(files)
    assert name in only_refusal(scan, reason).message
    assert [record.id.episode for record in scan.records] == ["000001"]


def test_depth_of_8_bits_is_refused(build, scan_scene):
    grey = cv2.imencode(".png", np.full((build.height, build.width), 99, np.uint8))[1].tobytes()
    files, _ = break_image(build, "depth", lambda data: grey)
    assert only_refusal(scan_scene(files), Reason.DEPTH_NOT_16_BIT).details["bits"] == 8


def test_an_image_of_another_size_is_refused(build, scan_scene):
    wide = cv2.imencode(".jpg", np.zeros((build.height, build.width + 8, 3), np.uint8))[1].tobytes()
    files, _ = break_image(build, "rgb", lambda data: wide)
    only_refusal(scan_scene(files), Reason.FRAME_SIZE_MISMATCH)


@pytest.mark.parametrize("prefixed", [True, False])
@pytest.mark.parametrize(
    ("missing", "reason"),
    [
        ([("rgb", 3)], Reason.FRAME_MISSING),
        ([("depth", 3)], Reason.FRAME_MISSING),
        ([("rgb", 3), ("depth", 3)], Reason.FRAME_MISSING),
        ([("rgb", 0), ("depth", 0)], Reason.FRAME_MISSING),
        ([("depth", 6)], Reason.FRAME_COUNT_MISMATCH),
        ([("rgb", 6)], Reason.FRAME_COUNT_MISMATCH),
        ([("rgb", 6), ("depth", 6)], Reason.TABLE_ROW_COUNT),
    ],
)
def test_missing_images_are_named_for_what_they_are(build, scan_scene, prefixed, missing, reason):
    """The second of three episodes loses images; where names are numbered through the scene, it has numbers 7 to 13."""
    files = build.scene_files({n: build.episode(n) for n in range(3)}, prefixed=prefixed)
    for kind, frame in missing:
        folder, ending = (build.rgb_folder, "jpg") if kind == "rgb" else (build.depth_folder, "png")
        del files[f"{folder}/{f'episode_000001_{frame:03d}' if prefixed else 7 + frame}.{ending}"]
    scan = scan_scene(files)
    only_refusal(scan, reason, "gibson_d435i/Acker.ville/000001")
    assert [record.id.episode for record in scan.records] == ["000000", "000002"]


def test_frame_numbers_of_a_scene_may_start_anywhere_when_all_are_there(build, scan_scene):
    files = build.scene_files({n: build.episode(n) for n in range(2)}, prefixed=False)
    shifted = {}
    for name, data in files.items():
        stem, dot, ending = name.rpartition(".")
        folder, slash, number = stem.rpartition("/")
        shifted[f"{folder}{slash}{int(number) + 1}{dot}{ending}" if number.isdigit() else name] = data
    assert len(scan_scene(shifted).records) == 2


def test_a_lost_start_of_unprefixed_frames_is_refused_and_not_shifted(build, scan_scene):
    files = build.scene_files({n: build.episode(n) for n in range(2)}, prefixed=False)
    for folder, ending in ((build.rgb_folder, "jpg"), (build.depth_folder, "png")):
        del files[f"{folder}/0.{ending}"]
    scan = scan_scene(files)
    assert [refusal.reason for refusal in scan.refusals] == [Reason.FRAME_MISSING] * 2
    assert scan.records == ()


def test_unprefixed_frames_of_several_episodes_need_their_statistics(build, scan_scene):
    files = build.scene_files({n: build.episode(n) for n in range(2)}, prefixed=False)
    files["meta/episodes_stats.jsonl"] = b"{half a li"
    scan = scan_scene(files)
    assert [refusal.reason for refusal in scan.refusals] == [Reason.FRAME_MISSING] * 2


@pytest.mark.parametrize("damage", ["absent", "garbage", "wrong"])
def test_meta_files_do_not_matter_where_they_are_not_needed(build, scan_scene, damage):
    files = build.scene_files({n: build.episode(n) for n in range(2)})
    for name in ("meta/episodes.jsonl", "meta/episodes_stats.jsonl", "meta/info.json"):
        if damage == "absent":
            del files[name]
        else:
            files[name] = b"\xff\x00{]\n[1, 2]\n3\n" if damage == "garbage" else b'{"image_index": {"min": "a"}}\n'
    scan = scan_scene(files)
    assert [record.notes for record in scan.records] == [(), ()]


def test_a_doubled_length_is_accepted_and_noted(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    lines = [{"episode_index": 0, "length": 14}, {"episode_index": 1, "length": 7}]
    files["meta/episodes.jsonl"] = "\n".join(json.dumps(line) for line in lines).encode()
    assert [record.notes for record in scan_scene(files).records] == [(Reason.EPISODE_LENGTH_MISMATCH.value,), ()]


def test_a_table_with_fewer_rows_than_images_is_refused(build, scan_scene):
    episode = build.episode(0)
    files = build.scene_files({0: episode})
    episode.poses = episode.poses[:-2]
    files["data/chunk-000/episode_000000.parquet"] = build.table(episode)
    refusal = only_refusal(scan_scene(files), Reason.TABLE_ROW_COUNT)
    assert refusal.details == {"rows": 5, "images": 7}


def test_images_without_a_table_are_refused_and_not_forgotten(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    del files["data/chunk-000/episode_000000.parquet"]
    only_refusal(scan_scene(files), Reason.TABLE_UNREADABLE)


@pytest.mark.parametrize(
    "K",
    [
        [[24, 0, 40], [0, 24, 11.5], [0, 0, 1]],  # principal point outside of the image
        [[0, 0, 15.5], [0, 24, 11.5], [0, 0, 1]],
        [[24, 2, 15.5], [0, 24, 11.5], [0, 0, 1]],  # skew
        [[24, 0, 15.5], [0, 24, 11.5], [0, 0, 2]],
    ],
)
def test_intrinsics_that_cannot_be_are_refused(build, scan_scene, K):
    episode = build.episode(0)
    episode.K = np.array(K, np.float32)
    only_refusal(scan_scene(build.scene_files({0: episode})), Reason.INTRINSICS_MISFIT)


def test_the_same_episode_in_two_chunks_is_refused_as_a_duplicate(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    files["data/chunk-001/episode_000000.parquet"] = files["data/chunk-000/episode_000000.parquet"]
    only_refusal(scan_scene(files), Reason.EPISODE_DUPLICATE)


def test_two_images_of_one_frame_are_refused_as_a_duplicate(build, scan_scene):
    files = build.scene_files({0: build.episode(0)})
    files[f"{build.rgb_folder}/episode_000000_3.jpg"] = files[f"{build.rgb_folder}/episode_000000_004.jpg"]
    only_refusal(scan_scene(files), Reason.EPISODE_DUPLICATE)


def test_two_trajectories_of_one_number_in_an_archive_are_both_refused(build, tmp_path, scan_all):
    one, two = build.trajectory_files(build.episode(0)), build.trajectory_files(build.episode(1))
    files = {f"trajectory_07/{name}": data for name, data in one.items()}
    files |= {f"traj_7/{name}": data for name, data in two.items()}
    build.write_archive(tmp_path, files)
    (scan,) = scan_all().values()
    assert scan.records == ()
    only_refusal(scan, Reason.EPISODE_DUPLICATE, "gibson_d435i/Acker.ville/000007")


def test_a_trajectory_folder_of_two_episodes_is_refused(build, tmp_path, scan_all):
    build.write_trajectories(tmp_path, {"trajectory_07": build.scene_files({0: build.episode(0), 1: build.episode(1)})})
    with pytest.raises(DataError) as caught:
        scan_all()
    assert caught.value.reason is Reason.EPISODE_DUPLICATE


def test_a_trajectory_folder_without_a_number_keeps_its_name(build, tmp_path, scan_all):
    build.write_trajectories(tmp_path, {"to_the_kitchen": build.trajectory_files(build.episode(0))})
    ((record,),) = (scan.records for scan in scan_all().values())
    assert record.id.episode == "to_the_kitchen"


def test_a_container_without_episodes_is_refused(build, scan_scene):
    with pytest.raises(DataError) as caught:
        scan_scene({"meta/info.json": b"{}", "meta/pointcloud.ply": build.cloud()})
    assert caught.value.reason is Reason.CONTAINER_NO_EPISODES


def test_an_archive_of_two_scenes_is_refused(build, tmp_path, scan_all):
    files = build.scene_files({0: build.episode(0)})
    path = build.write_archive(tmp_path, files)
    path.write_bytes(build.archive({f"{scene}/{name}": data for scene in "ab" for name, data in files.items()}))
    with pytest.raises(DataError) as caught:
        scan_all()
    assert caught.value.reason is Reason.CONTAINER_SEVERAL_SCENES


def test_hidden_files_are_not_read(build, scan_scene):
    files = build.scene_files({0: build.episode(0)})
    files["data/chunk-000/._episode_000000.parquet"] = b"resource fork"
    files["meta/.pointcloud.ply"] = b"half"
    assert len(scan_scene(files).records) == 1


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", Reason.CLOUD_UNREADABLE),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\n", Reason.CLOUD_HEADER),
    ],
)
def test_a_damaged_cloud_leaves_the_episodes_alone(build, scan_scene, data, reason):
    files = build.scene_files({0: build.episode(0)})
    files["meta/pointcloud.ply"] = data
    scan = scan_scene(files)
    assert len(scan.records) == 1
    assert scan.cloud is None
    assert scan.cloud_refusal is not None
    assert (scan.cloud_refusal.reason, scan.cloud_refusal.unit) == (reason, scan.records[0].container)
    assert scan.depth_samples == {}  # a damaged cloud is not replaced by another source


def test_a_cloud_with_a_nan_is_refused(build, scan_scene):
    files = build.scene_files({0: build.episode(0)})
    cloud = bytearray(build.cloud())
    cloud[-15:-11] = np.float32(np.nan).tobytes()
    files["meta/pointcloud.ply"] = bytes(cloud)
    assert scan_scene(files).cloud_refusal.reason is Reason.CLOUD_UNREADABLE


@pytest.mark.parametrize("prefixed", [True, False])
def test_without_a_cloud_every_nth_depth_image_is_kept(build, scan_scene, prefixed):
    episodes = {0: build.episode(0, frames=7), 1: build.episode(1, frames=8)}
    scan = scan_scene(build.scene_files(episodes, prefixed=prefixed, cloud=False), depth_sample_every=3)
    expected = {
        f"gibson_d435i/Acker.ville/{number:06d}": tuple((t, episode.depth[t]) for t in range(0, len(episode.depth), 3))
        for number, episode in episodes.items()
    }
    assert scan.depth_samples == expected
    assert scan.cloud is None
    assert scan.cloud_refusal is None


def test_depth_of_a_trajectory_folder_is_sampled_by_frame(build, tmp_path, scan_all):
    episode = build.episode(0, frames=12)
    build.write_trajectories(tmp_path, {"trajectory_00": build.trajectory_files(episode, cloud="")})
    (scan,) = scan_all(depth_sample_every=5).values()
    ((_, samples),) = scan.depth_samples.items()
    assert samples == tuple((t, episode.depth[t]) for t in (0, 5, 10))


def test_the_path_cloud_of_a_trajectory_folder_is_read(build, tmp_path, scan_all):
    files = build.trajectory_files(build.episode(0), cloud="data/chunk-000/path.ply")
    build.write_trajectories(tmp_path, {"trajectory_00": files})
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == 50


def test_clouds_of_an_archive_of_trajectories_are_put_together(build, tmp_path, scan_all):
    files = {
        f"trajectory_{n:02d}/{name}": data
        for n in range(2)
        for name, data in build.trajectory_files(build.episode(n)).items()
    }
    build.write_archive(tmp_path, files)
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == 100
    assert [record.id.episode for record in scan.records] == ["000000", "000001"]


def test_an_episode_that_is_only_named_is_refused_and_not_forgotten(build, scan_scene):
    files = build.scene_files({0: build.episode(0), 1: build.episode(1)})
    scan = scan_scene({name: data for name, data in files.items() if "episode_000000" not in name})
    only_refusal(scan, Reason.EPISODE_MISSING)
    assert [record.id.episode for record in scan.records] == ["000001"]


def test_the_list_of_a_scene_above_its_trajectory_folders_makes_no_episodes(build, tmp_path, scan_all):
    files = {f"trajectory_07/{name}": data for name, data in build.trajectory_files(build.episode(0)).items()}
    files["meta/episodes.jsonl"] = b'{"episode_index": 0, "length": 7}\n'
    build.write_archive(tmp_path, files)
    (scan,) = scan_all().values()
    assert ([record.id.episode for record in scan.records], scan.refusals) == (["000007"], ())


def test_a_folder_too_high_is_told_what_the_source_must_look_like(build, tmp_path, scan_all):
    build.write_archive(tmp_path / "above", build.scene_files({0: build.episode(0)}))
    with pytest.raises(DataError, match=r"<group>/<scene>\.tar\.gz") as caught:
        scan_all()
    assert caught.value.reason is Reason.CONTAINER_MISPLACED
