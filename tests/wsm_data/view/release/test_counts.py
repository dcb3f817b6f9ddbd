from wsm_data.view.release.counts import count_release


def test_clips_and_frames_are_counted_without_padding(release, made):
    counts = count_release(release)
    assert counts.clips == 6
    assert counts.frames == 6 * (made.frames - made.padded)
    assert counts.padded_frames == 6 * made.padded
    assert counts.frames_per_clip.tolist() == [9] * 6
    assert counts.bytes == sum(shard.bytes for shard in release.manifest.shards)


def test_groups_are_counted_by_split(release):
    counts = count_release(release)
    assert counts.splits == ("train", "test")
    assert [
        (group.group, group.camera, group.clips, group.scenes, dict(group.clips_by_split)) for group in counts.groups
    ] == [
        ("synth_d435i", "d435i", 3, 3, {"train": 3}),
        ("synth_zed", "zed", 3, 2, {"test": 3}),
    ]
    assert counts.cameras == {"d435i": 3, "zed": 3}


def test_a_scene_filmed_by_two_cameras_leaks_from_one_to_the_other(release):
    scenes = count_release(release).scenes
    assert scenes.total == 4
    assert scenes.by_split == {"test": 2, "train": 3}
    assert scenes.held_out == 2
    assert scenes.shared == ("synth/home_0001",)
    assert scenes.shared_clips == 2


def test_a_release_without_held_out_clips_has_no_leak(tmp_path, made):
    scenes = count_release(made.release(tmp_path, {"a_d435i/home/000000": "train"})).scenes
    assert (scenes.held_out, scenes.shared, scenes.shared_clips) == (0, (), 0)
