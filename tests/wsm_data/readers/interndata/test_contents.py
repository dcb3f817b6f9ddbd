import pytest

from wsm_data.errors import Reason
from wsm_data.readers.interndata.containers import find_containers
from wsm_data.readers.interndata.contents import read_contents


def contents_of(source, dataset, every=2):
    (container,) = find_containers(source, dataset)
    return read_contents(source, container, every, dataset.limits)


def test_one_pass_keeps_facts_and_lets_the_images_go(build, tmp_path, dataset):
    files = build.scene_files({0: build.episode(0)})
    build.write_archive(tmp_path, files)
    contents = contents_of(tmp_path, dataset)
    (folder,) = contents.folders.values()
    assert folder.depth_png == {}  # there is a cloud
    assert sorted(folder.rgb) == [(0, t) for t in range(7)]
    assert {image.size for image in folder.rgb.values()} == {(build.width, build.height)}
    unread = ("info.json", ".mp4")
    assert contents.bytes_read == sum(len(data) for name, data in files.items() if not name.endswith(unread))


def test_without_a_cloud_only_every_nth_depth_image_stays_in_memory(build, tmp_path, dataset):
    build.write_archive(tmp_path, build.scene_files({0: build.episode(0)}, cloud=False))
    (folder,) = contents_of(tmp_path, dataset, every=3).folders.values()
    assert sorted(folder.depth_png) == [(0, 0), (0, 3), (0, 6)]


BLACK_POINTS = 4


@pytest.mark.parametrize("cloud", ["meta/pointcloud.ply", "data/chunk-000/path.ply"])
@pytest.mark.parametrize("packed", [True, False])
def test_black_points_are_the_path_in_the_clouds_of_trajectories(build, tmp_path, scan_all, cloud, packed):
    files = build.trajectory_files(build.episode(0), cloud=cloud)
    files[cloud] = build.cloud(black=BLACK_POINTS)
    if packed:
        build.write_archive(tmp_path, {f"trajectory_01/{name}": data for name, data in files.items()})
    else:
        build.write_trajectories(tmp_path, {"trajectory_01": files})
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == 50 - BLACK_POINTS
    assert scan.cloud.rgb_u8.any(axis=1).all()


def test_black_points_of_a_scene_are_surface(build, scan_scene):
    files = build.scene_files({0: build.episode(0)})
    files["meta/pointcloud.ply"] = build.cloud(black=BLACK_POINTS)
    assert len(scan_scene(files).cloud.xyz_m) == 50


@pytest.mark.parametrize("own", [True, False])
def test_a_trajectory_without_a_cloud_has_the_one_of_its_scene(build, tmp_path, scan_all, own):
    files = build.trajectory_files(build.episode(0), cloud="meta/pointcloud.ply" if own else "")
    build.write_trajectories(tmp_path, {"trajectory_01": files})
    build.write_scene_folder(tmp_path, {"meta/pointcloud.ply": build.cloud(points=60, black=BLACK_POINTS)})
    (scan,) = scan_all().values()
    assert len(scan.cloud.xyz_m) == (50 if own else 60)  # a scene's black points are surface
    assert scan.depth_samples == {}


def test_a_damaged_cloud_of_the_scene_is_not_replaced_by_depth(build, tmp_path, scan_all):
    build.write_trajectories(tmp_path, {"trajectory_01": build.trajectory_files(build.episode(0), cloud="")})
    build.write_scene_folder(tmp_path, {"meta/pointcloud.ply": b""})
    (scan,) = scan_all().values()
    assert scan.cloud_refusal.reason is Reason.CLOUD_UNREADABLE
    assert scan.depth_samples == {}
