import pytest
from box_room import (
    DEPTH,
    RGB,
    Drive,
    along_x,
    moved,
    scene_files,
    write_archive,
)
from encode_scenes import HALL, ZED, again, frame

from pipelines.artifacts.layout import clips_folder
from pipelines.running.folder import read_stage_record
from wsm_data.errors import IntegrityError
from wsm_data.files.jsonlines import read_lines
from wsm_data.shards.fragment import read_fragment_info


def refused_here(make_pipeline, drives, damage=lambda pipeline: None):
    """Reasons for which the trajectories of one scene are refused at encode."""
    pipeline = make_pipeline({HALL: (drives, True)})
    damage(pipeline)
    pipeline.run_to("encode")
    return dict(pipeline.refusals("encode")), pipeline


def damage_inside(path):
    """Change bytes in the middle of a file, which its ends do not show."""
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = b"\xff\xd9" * 20
    path.write_bytes(bytes(data))


def test_what_cannot_be_used_is_refused_and_the_others_of_the_scene_go_on(make_pipeline):
    wrong_way = Drive(room=along_x().room, xy_m=along_x().xy_m, yaw_rad=along_x().yaw_rad + 1.0)
    files = scene_files({4: wrong_way})

    def damage(pipeline):
        damage_inside(frame(pipeline, HALL, 3, RGB, episode=2))
        damage_inside(frame(pipeline, HALL, 1, DEPTH, episode=3))
        for name, data in files.items():  # images of another drive, one for one
            if name.startswith("videos"):
                (pipeline.source / HALL / name).write_bytes(data)

    drives = {
        0: along_x(),
        1: along_x(y_m=1.48),  # 2 cm beside the pillar
        2: along_x(y_m=0.9),
        3: along_x(y_m=1.0),
        4: along_x(y_m=0.7, turn_rad=0.06),
        5: along_x(y_m=2.4),
    }
    reasons, pipeline = refused_here(make_pipeline, drives, damage)
    assert reasons == {
        f"{HALL}/000001": "path.through_obstacle",
        f"{HALL}/000002": "frame.undecodable",
        f"{HALL}/000003": "frame.undecodable",
        f"{HALL}/000004": "pose.depth_disagree",
    }
    assert {unit for unit, outcome in pipeline.outcomes("encode").items() if outcome.state == "done"} == {
        f"{HALL}/000000",
        f"{HALL}/000005",
    }
    for line in read_lines(pipeline.folder("encode") / "quarantine.jsonl"):
        assert line["unit"] in str(line["message"])
        assert line["source"] == HALL


def test_a_refused_trajectory_that_was_mended_is_encoded(make_pipeline):
    _, pipeline = refused_here(make_pipeline, {0: along_x(y_m=1.48), 1: along_x()})
    pipeline.write(HALL, {0: along_x()})
    again(pipeline)
    assert pipeline.run("encode").ran == (f"{HALL}/000000",)
    assert pipeline.refusals("encode") == []


def test_trajectories_of_a_scene_without_a_map_are_refused_with_its_reason(mapped, changed):
    before = mapped.inputs("encode")
    cloud = mapped.source / HALL / "meta/pointcloud.ply"
    whole = cloud.read_bytes()
    cloud.write_bytes(b"no cloud")
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {f"{HALL}/00000{n}": {"map"} for n in range(3)}
    report = mapped.run("encode")
    assert (report.done, report.refused) == (2, 3)
    (scene,) = read_lines(mapped.folder("map") / "quarantine.jsonl")
    for line in read_lines(mapped.folder("encode") / "quarantine.jsonl"):
        assert (line["reason"], line["details"]) == (scene["reason"], scene["details"])
        assert line["message"] == f"the scene of {line['unit']} has no map: {scene['message']}"
    cloud.write_bytes(whole)
    again(mapped)
    assert len(mapped.run("encode").ran) == 3
    assert mapped.refusals("encode") == []


def test_a_name_that_cannot_be_stored_is_refused_alone(make_pipeline):
    """Trajectory folders of one archive share a batch; the bad name stands in the middle."""
    pipeline = make_pipeline({})
    names = ("a_trajectory", "b" * 201, "c_trajectory")
    files = {
        f"{name}/{file}": data
        for number, name in enumerate(names)
        for file, data in scene_files({0: along_x(y_m=0.8 + 0.1 * number)}, cloud=number == 0).items()
    }
    write_archive(pipeline.source / f"{ZED}.tar.gz", files)
    pipeline.run_to("encode")
    assert pipeline.refusals("encode") == [(f"{ZED}/{names[1]}", "episode.unstorable_name")]
    states = {unit: outcome.state for unit, outcome in pipeline.outcomes("encode").items()}
    assert states == {f"{ZED}/{name}": "refused" if name == names[1] else "done" for name in names}


def test_a_source_that_changed_since_it_was_indexed_stops_the_stage(mapped):
    frame(mapped, HALL, 3, episode=1).write_bytes(frame(mapped, HALL, 4, episode=1).read_bytes())
    with pytest.raises(IntegrityError, match=f"{HALL}/000001 have other bytes; run `wsm index` again"):
        mapped.run("encode")
    assert f"{HALL}/000001" not in mapped.outcomes("encode")
    assert read_stage_record(mapped.folder("encode")).finished == ""


def test_a_camera_of_another_height_sees_another_map(make_pipeline):
    """The robot is as high as its camera: its map is its own, though the scene's is shared."""
    _, pipeline = refused_here(make_pipeline, {0: along_x(), 1: moved(along_x(y_m=2.4), height_m=0.3)})
    metas = [read_fragment_info(path).meta for path in sorted(clips_folder(pipeline.folder("encode")).rglob("*.clip"))]
    assert [meta.camera_height_m for meta in metas] == pytest.approx([0.5, 0.3])
    assert metas[0].map_digest == metas[1].map_digest
