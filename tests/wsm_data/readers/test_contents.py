from wsm_data.readers.containers import find_containers
from wsm_data.readers.contents import read_contents


def contents_of(source, dataset, every=2):
    (container,) = find_containers(source, dataset)
    return read_contents(source, container, every)


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
