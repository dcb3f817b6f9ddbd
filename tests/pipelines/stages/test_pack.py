import json
import shutil

import pytest
from box_room import MANIFEST_TOML, RGB, along_x

from pipelines.running.folder import read_stage_record
from pipelines.stages.pack import PackConfig
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.clips.config import ClipConfig
from wsm_data.codecs.quality import CodecQuality
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.files.json_values import from_json
from wsm_data.files.typed_toml import build_config
from wsm_data.shards.inventory import UnitState

DEN, HALL, ZED = "box_d435i/den", "box_d435i/hall", "box_zed/hall"
MANIFEST = "dataset.json"


@pytest.fixture
def encoded(make_pipeline):
    pipeline = make_pipeline({HALL: ({0: along_x(), 1: along_x(y_m=2.4)}, True), ZED: ({0: along_x(frames=6)}, True)})
    pipeline.run_to("encode")
    return pipeline


def files(pipeline):
    return {path.name: sha256_file(path) for path in sorted(pipeline.release.iterdir())}


def touch(pipeline, scene, episode=0):
    """Change one image of a trajectory, and run what comes before pack."""
    folder = pipeline.source / scene / RGB
    name = f"episode_{episode:06d}_{{:03d}}.jpg"
    image = (folder / name.format(3)).read_bytes()
    comment = b"\xff\xfe\x00\x03x"  # a segment that no decoder shows: the content is another all the same
    (folder / name.format(3)).write_bytes(image[:-2] + comment + image[-2:])
    for stage in ("index", "split", "map", "encode"):
        pipeline.run(stage)


# units


def test_every_shard_is_a_unit_and_its_input_the_clips_in_their_order(finished):
    units = finished.units("pack")
    index = open_release(finished.release).index
    stored = {name: [row.key for row in index.rows_of_shard(name)] for name in units}
    assert {name: [clip.key for clip in unit.payload.layout.clips] for name, unit in units.items()} == stored
    assert sum(len(keys) for keys in stored.values()) == 5
    assert {unit.payload.layout.split for unit in units.values()} == {"train", "test"}


def test_a_changed_clip_changes_the_shard_it_is_in_alone(encoded, changed):
    encoded.run("pack")
    before = encoded.inputs("pack")
    touch(encoded, HALL, episode=1)
    shard = open_release(encoded.release).index.row(f"{HALL}/000001").shard
    assert changed(before, encoded.inputs("pack")) == {shard: {"clips"}}


def test_another_seed_is_another_order_and_another_split_another_shard(encoded, changed):
    before = encoded.inputs("pack")
    assert any(changed(before, encoded.inputs("pack", seed=seed)) for seed in range(1, 5))
    encoded.run("split", options={"fork": True}, test_fraction=0.0)
    (forked,) = [path for path in encoded.run_folder.iterdir() if path.name.startswith("split-")]
    assert {unit.payload.layout.split for unit in encoded.units("pack", split=forked).values()} == {"train"}


def test_shards_are_filled_up_to_their_size(make_pipeline):
    drives = {number: along_x(y_m=0.7 + 0.1 * number, frames=5) for number in range(4)}
    settings = {"split": {"test_fraction": 0.0}, "encode": {"clip": ClipConfig(), "quality_share": 0.0}}
    pipeline = make_pipeline({ZED: (drives, True)}, **settings)
    pipeline.run_to("encode")
    sizes = [outcome.facts["bytes"] for outcome in pipeline.outcomes("encode").values()]
    assert max(sizes) * 3 < 1 << 20 < sum(sizes)  # three of them fit into a shard of 1 MiB, and not all four
    clips = [len(unit.payload.layout.clips) for unit in pipeline.units("pack", shard_mib=1).values()]
    assert clips == [3, 1]
    assert [len(unit.payload.layout.clips) for unit in pipeline.units("pack", shard_mib=2).values()] == [4]


def test_a_shard_without_room_is_refused():
    with pytest.raises(ConfigError, match="shard_mib must be at least 1, found 0"):
        build_config(PackConfig, {"index": "i", "split": "s", "map": "m", "encode": "e", "shard_mib": 0})


@pytest.mark.parametrize("missing", ["index", "split", "map", "encode"])
def test_it_starts_from_finished_stages(encoded, missing):
    shutil.rmtree(encoded.folder(missing))
    with pytest.raises(ConfigError, match=f"run `wsm {missing}` first"):
        encoded.run("pack")


def test_stages_that_are_older_than_their_inputs_are_refused(encoded):
    folder = encoded.source / HALL / RGB
    (folder / "episode_000000_003.jpg").write_bytes((folder / "episode_000000_002.jpg").read_bytes())
    encoded.run("index")
    with pytest.raises(ConfigError, match=r"is older than its input .*; run `wsm split` again"):
        encoded.run("pack")


def test_without_a_single_clip_there_is_nothing_to_pack(make_pipeline):
    # through the pillar
    pipeline = make_pipeline({HALL: ({0: along_x(y_m=1.7)}, True)})
    pipeline.run_to("encode")
    with pytest.raises(ConfigError, match=r"holds no clip; refused were\n  1 x path\.through_obstacle, as: .+"):
        pipeline.run("pack")


# the release


def test_a_release_says_what_it_is_made_of(finished):
    release = open_release(finished.release)
    manifest = release.manifest
    assert (manifest.name, manifest.clips, manifest.partial, manifest.pending) == ("release", 5, False, 0)
    assert manifest.frames == sum(release.read_clip(key).meta.frames for key in release.index.texts("key"))
    assert (manifest.encoded_width_px, manifest.encoded_height_px) == (64, 32)
    assert manifest.licences == {"box_rooms": "Apache-2.0"}
    assert manifest.fingerprints == {
        name: read_stage_record(finished.folder(name)).fingerprint for name in ("index", "split", "map", "encode")
    }
    assert manifest.drops == {}


def test_the_facts_of_a_shard_are_those_of_its_file(finished):
    for name, outcome in finished.outcomes("pack").items():
        path = finished.release / name
        assert outcome.outputs == (f"release/{name}",)
        assert outcome.digest == outcome.facts["shard"]["sha256"] == sha256_file(path)
        assert outcome.facts["bytes"] == path.stat().st_size
        assert outcome.facts["clips"] == len(list(open_release(finished.release).index.rows_of_shard(name)))


def test_the_quality_of_the_codec_is_that_of_all_measured_clips_together(finished):
    quality = from_json(CodecQuality, open_release(finished.release).manifest.codec_quality)
    single = [from_json(CodecQuality, outcome.facts["quality"]) for outcome in finished.outcomes("encode").values()]
    assert quality.clips == len(single) == 5
    assert quality.values == sum(one.values for one in single)
    assert quality.squared_error_sum == pytest.approx(sum(one.squared_error_sum for one in single), rel=1e-12)


def test_where_no_clip_was_measured_nothing_is_said_of_quality(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)}, encode={"quality_share": 0.0}, split={"test_fraction": 0.0})
    pipeline.run_to("pack")
    assert open_release(pipeline.release).manifest.codec_quality == {}


def test_refusals_of_index_and_encode_stand_in_the_release(make_pipeline):
    drives = {0: along_x(), 1: along_x(y_m=1.7), 2: along_x(frames=4)}
    pipeline = make_pipeline({HALL: (drives, True)}, split={"test_fraction": 0.0})
    pipeline.run_to("pack")
    release = open_release(pipeline.release)
    assert release.manifest.drops == {"episode.too_short": 1, "path.through_obstacle": 1}
    assert {(line["unit"], line["stage"]) for line in release.quarantine} == {
        (f"{HALL}/000001", "encode"),
        (f"{HALL}/000002", "index"),
    }
    assert [row.state for row in release.inventory] == [UnitState.CLIP, UnitState.REFUSED, UnitState.REFUSED]
    assert verify_release(pipeline.release) == []


def test_a_second_container_of_the_same_trajectories_leaves_a_sound_release(make_pipeline):
    scene = ({0: along_x(), 1: along_x(y_m=2.4)}, True)
    pipeline = make_pipeline({ZED: scene, f"{ZED}.tar.gz": scene}, split={"test_fraction": 0.0})
    pipeline.run_to("pack")
    assert open_release(pipeline.release).manifest.drops == {"episode.duplicate": 2}
    assert verify_release(pipeline.release) == []


# what is redone, and when a release is finished


def test_a_changed_trajectory_rewrites_its_shard_and_what_speaks_of_it(encoded):
    encoded.run("pack")
    before = files(encoded)
    touch(encoded, HALL, episode=1)
    (ran,) = encoded.run("pack").ran
    after = files(encoded)
    differ = {name for name in after if after[name] != before[name]}
    assert differ == {ran, "index.parquet", "inventory.parquet", MANIFEST}  # the source digest stands in both tables
    assert verify_release(encoded.release) == []


def test_a_refusal_alone_rewrites_the_books_and_no_shard(encoded):
    encoded.run("pack")
    before = files(encoded)
    encoded.write("box_zed/den", {0: along_x(frames=4)})
    for stage in ("index", "split", "map", "encode"):
        encoded.run(stage)
    assert encoded.run("pack").ran == ()
    after = files(encoded)
    assert {name for name in after if after[name] != before[name]} == {
        "inventory.parquet",
        "quarantine.jsonl",
        MANIFEST,
    }
    assert verify_release(encoded.release) == []


def test_a_changed_licence_reaches_the_release(encoded):
    encoded.run("pack")
    before = files(encoded)
    encoded.set_manifest(MANIFEST_TOML.replace("Apache-2.0", "CC0"))
    for stage in ("index", "split", "map", "encode", "pack"):
        assert encoded.run(stage).ran == ()
    after = files(encoded)
    assert {name for name in after if after[name] != before[name]} == {MANIFEST}
    assert open_release(encoded.release).manifest.licences == {"box_rooms": "CC0"}


def test_a_release_of_which_a_shard_is_being_written_is_unfinished(make_pipeline, finished):
    pipeline = make_pipeline({})
    shutil.copytree(finished.run_folder, pipeline.run_folder)
    whole = files(pipeline)
    for shard in pipeline.release.glob("*.tar"):
        shard.unlink()  # a unit whose output is gone is done again
    assert pipeline.run("pack", options={"limit": 1}).pending == 1
    assert not (pipeline.release / MANIFEST).exists()
    with pytest.raises(IntegrityError, match="unfinished; run `wsm pack` again"):
        open_release(pipeline.release)
    pipeline.run("pack")
    assert files(pipeline) == whole


def test_shards_of_an_earlier_deal_leave_the_release(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)}, split={"test_fraction": 0.0})
    pipeline.run_to("pack")
    assert {path.suffix for path in pipeline.release.iterdir()} >= {".tar"}
    shutil.rmtree(pipeline.folder("split"))
    pipeline.run("split", test_fraction=0.999)
    assert pipeline.run("pack").ran == ("test-000000.tar",)
    assert [path.name for path in pipeline.release.glob("*.tar")] == ["test-000000.tar"]
    assert verify_release(pipeline.release) == []


# partial releases


def test_pending_trajectories_are_packed_only_when_that_is_asked_for_and_the_release_says_so(make_pipeline):
    pipeline = make_pipeline()
    pipeline.run("index")
    pipeline.run("split")
    pipeline.run("map")
    pipeline.run("encode", options={"limit": 3})
    with pytest.raises(ConfigError, match=r"2 units are pending, such as .*--set partial=true"):
        pipeline.run("pack")
    pipeline.run("pack", partial=True)
    release = open_release(pipeline.release)
    assert (release.manifest.partial, release.manifest.pending, release.manifest.clips) == (True, 2, 3)
    assert verify_release(pipeline.release) == []


@pytest.mark.parametrize("stage", ["index", "map"])
def test_what_is_pending_before_encode_makes_a_release_partial_too(make_pipeline, stage):
    pipeline = make_pipeline()
    for name in ("index", "split", "map", "encode"):
        pipeline.run(name, options={"limit": 1} if name == stage else None)
    with pytest.raises(ConfigError, match=r"2 units are pending, such as box_d435i/hall"):
        pipeline.run("pack")
    pipeline.run("pack", partial=True)
    assert open_release(pipeline.release).manifest.partial
    assert verify_release(pipeline.release) == []


def test_a_partial_release_that_is_completed_is_the_one_that_was_never_partial(make_pipeline, finished):
    pipeline = make_pipeline()
    for name in ("index", "split", "map", "encode"):
        pipeline.run(name, options={"limit": 1})
    pipeline.run("pack", partial=True)
    assert json.loads((pipeline.release / MANIFEST).read_text())["partial"] is True
    pipeline.run_to("pack")
    assert files(pipeline) == files(finished)


def test_partial_is_no_setting(encoded):
    encoded.run("pack", partial=True)
    before = files(encoded)
    assert encoded.run("pack").ran == ()
    assert files(encoded) == before
    assert not open_release(encoded.release).manifest.partial  # nothing was pending


@pytest.mark.parametrize(
    ("stage", "name"), [("index", "episodes.jsonl"), ("split", "split.jsonl"), ("encode", "codec.json")]
)
def test_a_table_that_changed_since_its_stage_wrote_it_is_refused(encoded, stage, name):
    """A space more is the same JSON, and other bytes."""
    path = encoded.folder(stage) / name
    path.write_text(path.read_text().replace(": ", ":  ").replace('":', '": ', 1))
    with pytest.raises(IntegrityError, match=rf"{name} must hold what `wsm {stage}` wrote, found other bytes"):
        encoded.run("pack")


@pytest.mark.parametrize(("suffix", "redone"), [("clip", "*"), ("json", "*"), ("json", MANIFEST)])
def test_a_clip_that_changed_after_encode_is_refused_and_packed_once_it_is_made_again(encoded, suffix, redone):
    """Where the manifest alone is written again, sidecars are read for it, and no fragment."""
    encoded.run("pack")
    whole = files(encoded)
    damaged = min((encoded.folder("encode") / "clips").rglob(f"*.{suffix}"))
    data = damaged.read_bytes()
    damaged.write_bytes(data[:-8] + bytes([data[-8] ^ 1]) + data[-7:])
    for output in encoded.release.glob(redone):
        output.unlink()
    with pytest.raises(IntegrityError, match=rf"{damaged.name} must hold what `wsm encode` wrote, found other bytes"):
        encoded.run("pack")
    encoded.run("encode")
    encoded.run("pack")
    assert files(encoded) == whole
