import json
import shutil
from dataclasses import asdict, replace

import numpy as np
import pytest
from box_room import (
    MANIFEST_TOML,
    UPSTAIRS,
    along_x,
    lengths_bytes,
)
from encode_scenes import DEN, HALL, UNITS, ZED, again, frame

from pipelines.artifacts.episode_table import read_episodes
from pipelines.artifacts.layout import clips_folder, codec_path, map_path, records_path
from pipelines.stages import encode, index
from wsm_data.clips.config import ClipConfig
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.quality import CodecQuality
from wsm_data.codecs.registry import CodecConfig
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_file, xxh3_128
from wsm_data.files.json_values import from_json
from wsm_data.files.typed_toml import build_config
from wsm_data.readers.interndata.reader import INTERNDATA
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.fragment import fragment_path, read_fragment_info


def keep_cloud(pipeline, scene, drives):
    """Write drives into a scene without touching its cloud."""
    cloud = (pipeline.source / scene / "meta/pointcloud.ply").read_bytes()
    pipeline.write(scene, drives)
    (pipeline.source / scene / "meta/pointcloud.ply").write_bytes(cloud)


def clip_digests(pipeline):
    folder = clips_folder(pipeline.folder("encode"))
    return {str(path.relative_to(folder)): sha256_file(path) for path in sorted(folder.rglob("*")) if path.is_file()}


# units


def test_every_accepted_trajectory_is_a_unit_and_those_of_a_container_share_a_pass(mapped):
    units = mapped.units("encode")
    assert list(units) == UNITS
    assert {(unit.batch, unit.source) for unit in units.values()} == {(one, one) for one in (DEN, HALL, ZED)}
    assert set(units[UNITS[0]].inputs) == {"trajectory", "map", "codec", "dataset"}


def test_a_changed_image_changes_its_own_trajectory_alone(mapped, changed):
    before = mapped.inputs("encode")
    image = frame(mapped, HALL, 3, episode=1)
    comment = b"\xff\xfe\x00\x03x"  # a segment that no decoder shows: the content is another all the same
    image.write_bytes(image.read_bytes()[:-2] + comment + image.read_bytes()[-2:])
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {f"{HALL}/000001": {"trajectory"}}


def test_a_trajectory_on_another_floor_changes_nothing_here(mapped, changed):
    before = mapped.inputs("encode")
    keep_cloud(mapped, ZED, {1: along_x(room=UPSTAIRS, y_m=1.2)})
    again(mapped)
    assert mapped.outcomes("map")[ZED].facts["floors"] == 2
    assert list(changed(before, mapped.inputs("encode"))) == [f"{ZED}/000001"]


def test_another_trajectory_on_this_floor_changes_nothing_here_where_there_is_a_cloud(mapped, changed):
    before = mapped.inputs("encode")
    keep_cloud(mapped, HALL, {3: along_x(y_m=1.0)})
    again(mapped)
    assert list(changed(before, mapped.inputs("encode"))) == [f"{HALL}/000003"]


def test_another_trajectory_changes_the_map_of_the_others_where_depth_is_fused(mapped, changed):
    before = mapped.inputs("encode")
    mapped.write(DEN, {1: along_x(y_m=1.6)}, cloud=False)
    again(mapped)
    found = changed(before, mapped.inputs("encode"))
    assert list(found) == [f"{DEN}/000000", f"{DEN}/000001"]
    assert found[f"{DEN}/000000"] == {"map"}


def test_furniture_that_is_moved_upstairs_changes_what_is_upstairs(mapped, changed):
    before = mapped.inputs("encode")
    cloud = mapped.source / HALL / "meta/pointcloud.ply"
    data = bytearray(cloud.read_bytes())
    data[-15:-3] = np.array([3.0, 1.0, 3.3], "<f4").tobytes()  # the last point is one of a wall upstairs
    cloud.write_bytes(data)
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {f"{HALL}/000002": {"map"}}


def test_another_codec_changes_every_trajectory(mapped, changed, monkeypatch):
    before = mapped.inputs("encode")

    monkeypatch.setattr(encode, "describe_codec", lambda config: replace(DctCodec().describe(), digest="other"))
    assert changed(before, mapped.inputs("encode")) == {unit: {"codec"} for unit in UNITS}


def test_a_changed_convention_changes_every_trajectory(mapped, changed):
    before = mapped.inputs("encode")
    mapped.set_manifest("max_pitch_deg = 44.0\n" + MANIFEST_TOML)
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {unit: {"dataset"} for unit in UNITS}


def test_a_changed_licence_changes_no_trajectory(mapped, changed):
    mapped.run("encode")
    before = mapped.inputs("encode")
    mapped.set_manifest(MANIFEST_TOML.replace("Apache-2.0", "CC0"))
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {}
    assert mapped.run("encode").ran == ()


def test_a_reader_that_converts_otherwise_makes_every_clip_anew(mapped, changed, monkeypatch):
    """What is stored is the same; its content digest cannot tell."""
    mapped.run("encode")
    before, clips = mapped.inputs("encode"), clip_digests(mapped)
    scan_as_before = INTERNDATA.scan

    def scan(*arguments):
        found = scan_as_before(*arguments)
        return replace(
            found, records=[replace(one, camera_pitch_rad=one.camera_pitch_rad + 1e-9) for one in found.records]
        )

    monkeypatch.setattr(index, "source_reader", lambda _dataset: replace(INTERNDATA, scan=scan))
    shutil.rmtree(mapped.folder("index"))
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {unit: {"trajectory"} for unit in UNITS}
    assert set(mapped.run("encode").ran) == set(UNITS)
    after = clip_digests(mapped)
    assert [name for name in clips if after[name] == clips[name]] == []


def test_a_codec_is_loaded_once_in_a_process_and_only_described_elsewhere(mapped, monkeypatch):
    loaded = []

    def make(config):
        loaded.append(config)
        return DctCodec()

    monkeypatch.setattr(encode, "make_codec", make)
    encode._loaded_codec.cache_clear()
    mapped.run("encode")  # three containers
    assert loaded == [CodecConfig()]
    shutil.rmtree(mapped.folder("encode"))
    mapped.run("encode")
    assert loaded == [CodecConfig()]


def test_weights_that_were_changed_while_the_stage_ran_are_refused(mapped, monkeypatch):
    listed = replace(DctCodec().describe(), digest="other")
    monkeypatch.setattr(encode, "describe_codec", lambda config: listed)
    with pytest.raises(ConfigError, match="were changed while the stage ran; run `wsm encode` again"):
        mapped.run("encode")


def test_a_note_that_comes_or_goes_changes_its_trajectory(mapped, changed):
    """The clip holds the note, and neither images, poses nor map tell of it, but the record does."""
    before = mapped.inputs("encode")
    (mapped.source / HALL / "meta/episodes.jsonl").write_bytes(lengths_bytes({0: 7, 1: 14, 2: 7}))
    again(mapped)
    assert changed(before, mapped.inputs("encode")) == {f"{HALL}/000001": {"trajectory"}}


def test_the_layout_is_no_input_and_the_clips_are_the_same(make_pipeline, changed):
    pipeline = make_pipeline({ZED: ({0: along_x(frames=6)}, True)})
    pipeline.run_to("encode")
    before, clips = pipeline.inputs("encode"), clip_digests(pipeline)
    shutil.rmtree(pipeline.source / ZED)
    pipeline.write(f"{ZED}.tar.gz", {0: along_x(frames=6)})
    again(pipeline)
    assert changed(before, pipeline.inputs("encode")) == {}
    assert pipeline.run("encode").ran == ()
    shutil.rmtree(pipeline.folder("encode"))
    pipeline.run("encode")
    assert clip_digests(pipeline) == clips


def test_a_trajectory_whose_map_is_pending_is_not_listed_yet(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index")
    pipeline.run("map", options={"only": (HALL,)})
    assert list(pipeline.units("encode")) == [f"{HALL}/00000{number}" for number in range(3)]


def test_of_a_trajectory_that_stands_twice_the_kept_one_is_the_unit(make_pipeline):
    pipeline = make_pipeline(
        {ZED: ({0: along_x()}, True), f"{ZED}.tar.gz": ({0: along_x(), 1: along_x(y_m=1.0)}, True)}
    )
    pipeline.run_to("map")
    units = pipeline.units("encode")
    assert {name: unit.source for name, unit in units.items()} == {
        f"{ZED}/000000": ZED,
        f"{ZED}/000001": f"{ZED}.tar.gz",
    }


@pytest.mark.parametrize("missing", ["index", "map"])
def test_it_starts_from_finished_stages(mapped, missing):
    shutil.rmtree(mapped.folder(missing))
    with pytest.raises(ConfigError, match=f"run `wsm {missing}` first"):
        mapped.run("encode")


@pytest.mark.parametrize(("stage", "path_of"), [("index", records_path), ("map", map_path)])
def test_what_a_stage_before_wrote_is_refused_once_it_changed(mapped, stage, path_of):
    path = path_of(mapped.folder(stage), HALL)
    path.write_bytes(path.read_bytes()[::-1])
    with pytest.raises(IntegrityError, match=rf"{path.name} must hold what `wsm {stage}` wrote, found other bytes"):
        mapped.run("encode")


@pytest.mark.parametrize("share", [-0.1, 1.1])
def test_a_share_of_clips_lies_between_none_and_all(share):
    with pytest.raises(ConfigError, match=r"quality_share must lie in \[0, 1\]"):
        build_config(encode.EncodeConfig, {"index": "i", "map": "m", "quality_share": share})


# what is written


def test_the_outputs_of_a_trajectory_are_its_clip_and_what_vouches_for_it(finished):
    folder = finished.folder("encode")
    for unit, outcome in finished.outcomes("encode").items():
        path = fragment_path(clips_folder(folder), EpisodeId.parse(unit).key)
        assert [folder / name for name in outcome.outputs] == [path, path.with_suffix(".json")]
        info = read_fragment_info(path)
        assert outcome.digest == info.digest == xxh3_128(path.read_bytes())
        assert outcome.facts["bytes"] == info.size_bytes == path.stat().st_size
        assert outcome.facts["frames"] == info.meta.frames - info.meta.padded_frames
        assert outcome.facts["source_digest"] == info.meta.source_digest


def test_a_clip_knows_the_map_and_the_codec_it_was_made_with(finished):
    content = {row.id.text: row.digest for row in read_episodes(finished.folder("index"))}
    for name, unit in finished.units("encode").items():
        path = fragment_path(clips_folder(finished.folder("encode")), EpisodeId.parse(name).key)
        meta = read_fragment_info(path).meta
        assert meta.source_digest == content[name]
        assert meta.map_digest == unit.inputs["map"]
        assert meta.codec_digest == unit.inputs["codec"] == DctCodec().describe().digest
        assert (meta.map_from, meta.notes) == (("depth", ("cloud.missing",)) if DEN in name else ("cloud", ()))
        assert (meta.freed_cells > 0) == (DEN in name)  # nobody sees the floor it stands on


def test_the_codec_describes_itself_beside_the_clips(finished):
    stored = json.loads(codec_path(finished.folder("encode")).read_text())
    assert stored == json.loads(json.dumps(asdict(DctCodec().describe())))


def test_batches_of_clips_are_a_setting_and_the_built_in_codec_does_not_know_them(mapped):
    mapped.run("encode")
    clips = clip_digests(mapped)
    batched = {"codec": CodecConfig(batch_clips=2)}
    with pytest.raises(ConfigError, match=r"codec\.batch_clips: 1 -> 2"):
        mapped.run("encode", **batched)
    shutil.rmtree(mapped.folder("encode"))
    mapped.run("encode", **batched)  # three clips of the hall: a full batch, and one that is not
    assert clip_digests(mapped) == clips


def test_a_codec_is_given_the_two_videos_of_one_clip_at_a_time(mapped, monkeypatch):
    calls = []

    class Watched(DctCodec):
        def encode_many(self, videos):
            calls.append([len(video) for video in videos])
            return super().encode_many(videos)

    monkeypatch.setattr(encode, "make_codec", lambda config: Watched())
    encode._loaded_codec.cache_clear()
    mapped.run("encode")
    encode._loaded_codec.cache_clear()
    assert [len(lengths) for lengths in calls if lengths] == [2] * len(UNITS)
    assert all(len(set(lengths)) <= 1 for lengths in calls)


def test_another_share_of_measured_clips_makes_no_clip_anew(mapped):
    mapped.run("encode")
    assert mapped.run("encode", quality_share=0.0).ran == ()


def test_the_share_of_measured_clips_depends_on_their_ids_alone_and_grows_with_it(mapped):
    measured = {}
    for share in (0.0, 0.5, 1.0):
        mapped.run("encode", quality_share=share)
        facts = {unit: outcome.facts["quality"] for unit, outcome in mapped.outcomes("encode").items()}
        measured[share] = {unit for unit, quality in facts.items() if quality}
        assert all(from_json(CodecQuality, facts[unit]).clips == 1 for unit in measured[share])
        shutil.rmtree(mapped.folder("encode"))
    assert measured[0.0] == set() < measured[0.5] < measured[1.0] == set(UNITS)


def test_a_touched_trajectory_is_encoded_alone(mapped):
    mapped.run("encode")
    before = clip_digests(mapped)
    image = frame(mapped, HALL, 3, episode=1)
    comment = b"\xff\xfe\x00\x03x"  # a segment that no decoder shows: the content is another all the same
    image.write_bytes(image.read_bytes()[:-2] + comment + image.read_bytes()[-2:])
    again(mapped)
    assert mapped.run("encode").ran == (f"{HALL}/000001",)
    after = clip_digests(mapped)
    assert {name for name in after if after[name] != before[name]} == {
        f"{HALL}/000001{end}" for end in (".clip", ".json")
    }


def test_a_note_that_went_away_leaves_the_clip(mapped):
    lengths = mapped.source / HALL / "meta/episodes.jsonl"
    right = lengths.read_bytes()
    lengths.write_bytes(lengths_bytes({0: 7, 1: 14, 2: 7}))
    again(mapped)
    mapped.run("encode")
    path = fragment_path(clips_folder(mapped.folder("encode")), f"{HALL}/000001")
    assert read_fragment_info(path).meta.notes == ("episode.length_mismatch",)
    lengths.write_bytes(right)
    again(mapped)
    mapped.run("encode")
    assert read_fragment_info(path).meta.notes == ()


# refusals


def test_clips_of_another_size_are_other_settings(mapped):
    mapped.run("encode", options={"limit": 1})
    with pytest.raises(ConfigError, match=r"clip\.width: 64 -> 96"):
        mapped.run("encode", clip=ClipConfig(width=96, height=32))
