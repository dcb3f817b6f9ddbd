import errno
import os

import pytest

from wsm_data.errors import ConfigError
from wsm_data.readers.interndata.containers import Place, find_containers, place_of
from wsm_data.schema.source.layout import Layout


def refuse_listing(monkeypatch, name):
    """As for a folder without permission; a superuser, who runs tests in containers, has them all."""
    scandir = os.scandir

    def refusing(path):
        if os.fspath(path).endswith(f"/{name}"):
            raise PermissionError(errno.EACCES, "Permission denied", os.fspath(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refusing)


def find(source, dataset):
    return {container.id: container for container in find_containers(source, dataset)}


def test_mixed_layouts_in_one_tree_are_all_found(build, tmp_path, dataset):
    episode = build.episode(0)
    build.write_archive(tmp_path, build.scene_files({0: episode}))
    build.write_scene_folder(tmp_path, build.scene_files({0: episode}))
    build.write_trajectories(tmp_path, {"trajectory_01": build.trajectory_files(episode)})
    found = find(tmp_path, dataset)
    assert [(id_, container.layout) for id_, container in found.items()] == [
        ("gibson_d435i/Acker.ville", Layout.SCENE_FOLDER),
        ("gibson_d435i/Acker.ville.tar.gz", Layout.SCENE_ARCHIVE),
        ("gibson_d435i/Acker.ville/trajectory_01", Layout.TRAJECTORY_FOLDER),
    ]
    assert {place_of(container) for container in found.values()} == {
        Place("gibson_d435i", "Acker.ville", None),
        Place("gibson_d435i", "Acker.ville", "trajectory_01"),
    }


def test_a_scene_of_trajectory_folders_alone_is_no_scene_folder(build, tmp_path, dataset):
    build.write_trajectories(tmp_path, {"trajectory_01": build.trajectory_files(build.episode(0))})
    assert list(find(tmp_path, dataset)) == ["gibson_d435i/Acker.ville/trajectory_01"]


def test_what_is_none_of_the_layouts_is_listed_and_not_passed_over(tmp_path, dataset):
    (tmp_path / "group" / "empty_scene").mkdir(parents=True)
    (tmp_path / "group" / "half" / "strange").mkdir(parents=True)
    (tmp_path / "group" / "plain.tar").write_bytes(b"")
    (tmp_path / "group" / "other.zip").write_bytes(b"")
    assert list(find(tmp_path, dataset)) == [
        "group/empty_scene",
        "group/half/strange",
        "group/other.zip",
        "group/plain.tar",
    ]


def test_hidden_names_and_loose_files_are_not_containers(build, tmp_path, dataset):
    build.write_archive(tmp_path, {})
    (tmp_path / ".cache" / "scene").mkdir(parents=True)
    (tmp_path / "gibson_d435i" / ".part.tar.gz").write_bytes(b"")
    (tmp_path / "gibson_d435i" / "README.md").write_text("")
    (tmp_path / "README.md").write_text("")
    assert list(find(tmp_path, dataset)) == ["gibson_d435i/Acker.ville.tar.gz"]


@pytest.mark.parametrize("make", ["nothing", "file", "empty", "empty_group"])
def test_an_absent_or_empty_source_is_a_wrong_request(tmp_path, dataset, make):
    source = tmp_path / "source"
    if make == "file":
        source.write_text("")
    elif make != "nothing":
        (source / ("group" if make == "empty_group" else "")).mkdir(parents=True)
    with pytest.raises(ConfigError, match="source"):
        find_containers(source, dataset)


def test_the_signature_tells_touched_from_untouched(build, tmp_path, dataset):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    build.write_trajectories(tmp_path, {"trajectory_01": build.trajectory_files(build.episode(1))})
    before = find(tmp_path, dataset)
    assert before == find(tmp_path, dataset)
    image = tmp_path / "gibson_d435i/Acker.ville" / build.rgb_folder / "episode_000000_000.jpg"
    status = image.stat()
    os.utime(image, ns=(status.st_atime_ns, status.st_mtime_ns + 1))
    after = find(tmp_path, dataset)
    changed = [id_ for id_ in before if before[id_] != after[id_]]
    assert changed == ["gibson_d435i/Acker.ville"]  # not the trajectory beside it


@pytest.mark.parametrize("change", ["append", "add", "remove"])
def test_the_signature_sees_sizes_and_names(build, tmp_path, dataset, change):
    build.write_scene_folder(tmp_path, build.scene_files({0: build.episode(0)}))
    before = find(tmp_path, dataset)
    meta = tmp_path / "gibson_d435i/Acker.ville/meta"
    info = meta / "info.json"
    status = info.stat()
    if change == "append":
        info.write_bytes(b"{ }")
        os.utime(info, ns=(status.st_atime_ns, status.st_mtime_ns))
    elif change == "add":
        (meta / "more.json").write_bytes(b"")
    else:
        info.unlink()
    assert find(tmp_path, dataset) != before


@pytest.mark.parametrize(
    ("link", "layout"),
    [
        ("group/scene.tar.gz", Layout.SCENE_ARCHIVE),
        ("group/scene", Layout.SCENE_FOLDER),
        ("group/scene/trajectory_01", Layout.TRAJECTORY_FOLDER),
    ],
)
@pytest.mark.parametrize("target", ["gone", "itself"])
def test_a_link_that_leads_nowhere_is_listed_and_not_passed_over(tmp_path, dataset, link, layout, target):
    path = tmp_path / link
    path.parent.mkdir(parents=True)
    path.symlink_to(path if target == "itself" else tmp_path / "gone")
    found = find(tmp_path, dataset)
    assert [(id_, container.layout) for id_, container in found.items()] == [(link, layout)]


@pytest.mark.parametrize("name", ["meta/more.json", "data", "videos/chunk-000/observation.images.rgb/9.jpg"])
def test_a_link_that_leads_nowhere_is_signed_by_its_name(build, tmp_path, dataset, name):
    files = build.trajectory_files(build.episode(0))
    build.write_scene_folder(tmp_path, {file: data for file, data in files.items() if not file.startswith("data/")})
    before = find(tmp_path, dataset)
    link = tmp_path / "gibson_d435i/Acker.ville" / name
    link.symlink_to(tmp_path / "gone")
    broken = find(tmp_path, dataset)
    assert broken != before
    assert broken == find(tmp_path, dataset)
    (tmp_path / "gone").write_bytes(b"back")
    assert find(tmp_path, dataset) != broken


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("scene.tar.gz.part", "scene"),
        ("scene.tar.gz.incomplete", "scene"),
        ("scene.tar.gz.aria2", "scene"),
        ("Unconfirmed 7.crdownload", "Unconfirmed 7"),
        ("sce.ne.tgz.PART", "sce.ne"),
    ],
)
def test_an_unfinished_download_is_listed_and_not_passed_over(tmp_path, dataset, name, scene):
    (tmp_path / "group").mkdir()
    (tmp_path / "group" / name).write_bytes(b"")
    (container,) = find_containers(tmp_path, dataset)
    assert (container.id, place_of(container).scene, container.layout) == (f"group/{name}", scene, Layout.SCENE_ARCHIVE)


def test_the_cloud_of_a_scene_is_signed_with_each_of_its_trajectories(build, tmp_path, dataset):
    files = build.trajectory_files(build.episode(0), cloud="")
    build.write_trajectories(tmp_path, {"trajectory_01": files, "trajectory_02": files})
    before = find(tmp_path, dataset)
    cloud = tmp_path / "gibson_d435i/Acker.ville/meta/pointcloud.ply"
    cloud.parent.mkdir()
    cloud.write_bytes(build.cloud())
    after = find(tmp_path, dataset)
    assert list(after) == list(before)
    assert all(after[id_].signature != before[id_].signature for id_ in before)


def test_a_group_that_cannot_be_listed_is_a_wrong_request(tmp_path, dataset, monkeypatch):
    (tmp_path / "group" / "scene").mkdir(parents=True)
    refuse_listing(monkeypatch, "group")
    with pytest.raises(ConfigError, match="group: Permission denied"):
        find_containers(tmp_path, dataset)


def test_a_scene_that_cannot_be_listed_is_a_container_all_the_same(tmp_path, dataset, monkeypatch):
    (tmp_path / "group" / "scene").mkdir(parents=True)
    refuse_listing(monkeypatch, "scene")
    assert list(find(tmp_path, dataset)) == ["group/scene"]


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("home.tar.gz", "home"), ("home.TAR.GZ", "home"), ("home.tgz", "home"), ("home.tar.zst", "home"),
        ("home.7z", "home"), ("home.tbz2", "home"), ("home.tar.gz.aa", "home"), ("home.tar.gz.part1", "home"),
        ("home.7z.001", "home"), ("home.part02.rar", "home.part02"), ("home.zip.z01", "home.zip"),
    ],
)  # fmt: skip
def test_whatever_is_surely_an_archive_is_a_container(tmp_path, dataset, name, scene):
    path = tmp_path / "group" / name
    path.parent.mkdir()
    path.write_bytes(b"x")
    (container,) = find_containers(tmp_path, dataset)
    assert (container.id, place_of(container).scene) == (f"group/{name}", scene)


@pytest.mark.parametrize("name", ["home.tar.gz.md5", "home.tar.gz.asc", "home.txt", "README"])
def test_what_stands_beside_an_archive_is_none(tmp_path, dataset, name):
    for each in (name, "home.tar.gz"):
        path = tmp_path / "group" / each
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"x")
    assert [container.id for container in find_containers(tmp_path, dataset)] == ["group/home.tar.gz"]


def test_archives_at_another_depth_are_containers_beside_those_at_theirs(tmp_path, dataset):
    for name in ("top.tar.gz", "group/home.tar.gz", "group/folder/deep.tar.gz"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
    found = [container.id for container in find_containers(tmp_path, dataset)]
    assert found == ["group/folder/deep.tar.gz", "group/home.tar.gz", "top.tar.gz"]
