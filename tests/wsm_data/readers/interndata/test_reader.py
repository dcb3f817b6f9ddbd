import pytest

from wsm_data.readers.interndata.reader import INTERNDATA


@pytest.mark.parametrize("layout", ["scene_archive", "scene_folder", "trajectory_folder"])
def test_an_episode_of_any_layout_goes_through_all_three_functions(build, tmp_path, dataset, layout):
    episode = build.episode(0)
    if layout == "trajectory_folder":
        build.write_trajectories(tmp_path, {"trajectory_0": build.trajectory_files(episode)})
    else:
        write = build.write_archive if layout == "scene_archive" else build.write_scene_folder
        write(tmp_path, build.scene_files({0: episode}))
    (container,) = INTERNDATA.find_containers(tmp_path, dataset)
    assert container.layout == layout
    records = INTERNDATA.scan(tmp_path, container, dataset, 10).records
    ((record, frames),) = INTERNDATA.iter_frames(tmp_path, container, dataset, records)
    assert record.id.text == "gibson_d435i/Acker.ville/000000"
    assert (list(frames.rgb), list(frames.depth)) == (list(episode.rgb), list(episode.depth))
