import os
import shutil

import fsspec
import pytest
from box_room import along_x

from pipelines.running.folder import read_stage_record
from pipelines.running.ledger import read_ledger
from pipelines.stages.verify import require_sound
from wsm_data.access.release import open_release
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.digest import sha256_file
from wsm_data.files.jsonlines import read_lines

ZED = "box_zed/hall"


@pytest.fixture(scope="session")
def packed(tmp_path_factory, finished):
    """A release and the way to damage a copy of it."""

    def copy():
        folder = tmp_path_factory.mktemp("release") / "release"
        shutil.copytree(finished.release, folder)
        return folder

    return copy


@pytest.fixture
def pipeline(make_pipeline, packed):
    """A pipeline of which nothing but the release is there."""
    empty = make_pipeline({})
    empty.folder("pack").mkdir(parents=True)
    shutil.copytree(packed(), empty.release)
    return empty


def flip(path, offset):
    """Change one byte, and nothing that a listing of the folder shows."""
    status = path.stat()
    data = bytearray(path.read_bytes())
    data[offset] ^= 0x40
    path.write_bytes(bytes(data))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns + 1))


def member_of(release, key, name):
    """Shard, and offset in it of a member of a clip."""
    row = open_release(release).index.row(key)
    member = next(one for one in row.members if one.name == name)
    return release / row.shard, row.clip_offset + member.array_offset


def test_a_sound_release_is_counted(pipeline):
    assert require_sound(str(pipeline.release), quiet=True) == 5
    report = pipeline.run("verify")
    assert (report.ran, report.facts) == (("release",), {"clips": 5, "findings": 0})


@pytest.mark.parametrize("name", ["rgb_latent", "poses", "meta"])
def test_a_flipped_byte_is_named_by_shard_and_clip_and_member(pipeline, name):
    key = f"{ZED}/000000"
    shard, offset = member_of(pipeline.release, key, name)
    flip(shard, offset + 5)
    file = "meta.json" if name == "meta" else f"{name}.npy"
    with pytest.raises(IntegrityError) as caught:
        pipeline.run("verify")
    message = str(caught.value)
    assert f"clip.payload: {shard.name} {key}: the checksum of {file}" in message
    assert f"shard.changed: {shard.name}" in message
    assert message.startswith(f"{pipeline.release} is damaged, 2 findings:")


def test_one_finding_is_one_and_a_file_beside_the_shards_is_named_once(pipeline):
    (pipeline.release / "quarantine.jsonl").unlink()
    with pytest.raises(IntegrityError) as caught:
        require_sound(str(pipeline.release), quiet=True)
    first, line = str(caught.value).splitlines()
    assert first == f"{pipeline.release} is damaged, 1 finding:"
    assert line == f"  file.changed: {pipeline.release}/quarantine.jsonl is missing; fetch it again"


def test_damage_is_never_recorded_as_done_and_is_found_again(pipeline):
    pipeline.run("verify")
    shard, offset = member_of(pipeline.release, f"{ZED}/000000", "poses")
    flip(shard, offset)
    for _ in range(2):
        with pytest.raises(IntegrityError):
            pipeline.run("verify")
        assert read_stage_record(pipeline.folder("verify")).finished == ""
    flip(shard, offset)
    assert pipeline.run("verify").ran == ("release",)
    assert read_stage_record(pipeline.folder("verify")).finished
    assert [one.outcome.facts["findings"] for one in read_ledger(pipeline.folder("verify")).values()] == [0]


def test_a_release_that_was_not_touched_is_not_read_again(pipeline, monkeypatch):
    pipeline.run("verify")
    monkeypatch.setattr("pipelines.stages.verify.require_sound", None)
    assert pipeline.run("verify").ran == ()


@pytest.mark.parametrize("name", ["index.parquet", "inventory.parquet", "quarantine.jsonl", "train-000000.tar"])
def test_every_file_of_a_release_is_looked_at_when_it_was_touched(pipeline, name):
    pipeline.run("verify")
    os.utime(pipeline.release / name)
    assert pipeline.run("verify").ran == ("release",)


@pytest.mark.parametrize("name", ["index.parquet", "inventory.parquet", "test-000000.tar"])
def test_a_file_that_is_gone_is_named(pipeline, name):
    (pipeline.release / name).unlink()
    with pytest.raises(IntegrityError, match=name):
        pipeline.run("verify")


def test_many_findings_are_counted_and_the_first_of_them_shown(pipeline):
    for shard in pipeline.release.glob("*.tar"):
        shard.write_bytes(bytes(shard.stat().st_size))  # every header and payload of every clip
    with pytest.raises(IntegrityError) as caught:
        require_sound(str(pipeline.release), quiet=True)
    lines = str(caught.value).splitlines()
    total = int(lines[0].split(", ")[1].split()[0])
    assert total > 20
    assert len(lines) == 1 + 20 + 1
    assert lines[-1] == f"  and {total - 20} more"


def test_an_unfinished_release_is_no_sound_one(pipeline):
    (pipeline.release / "dataset.json").unlink()
    with pytest.raises(IntegrityError, match=r"has no dataset\.json, so the release is unfinished"):
        pipeline.run("verify")


def test_a_release_that_is_not_there_is_a_wrong_request(make_pipeline):
    with pytest.raises(ConfigError, match="there is no release at"):
        make_pipeline({}).run("verify")


def test_a_release_in_a_store_is_read_through_it(packed, make_pipeline):
    folder, store = packed(), fsspec.filesystem("memory")
    for path in folder.iterdir():
        store.pipe_file(f"/verified/{path.name}", path.read_bytes())
    pipeline = make_pipeline({}, verify={"release": "memory://verified"})
    assert set(pipeline.inputs("verify")["release"]) == {"manifest"}
    assert pipeline.run("verify").facts["clips"] == 5
    store.rm("/verified", recursive=True)


def test_a_release_that_is_packed_anew_is_read_again(make_pipeline):
    pipeline = make_pipeline({ZED: ({0: along_x()}, True)}, split={"test_fraction": 0.0})
    pipeline.run_to("verify")
    before = sha256_file(pipeline.release / "dataset.json")
    pipeline.write(ZED, {1: along_x(y_m=1.0)})
    pipeline.run_to("pack")
    assert sha256_file(pipeline.release / "dataset.json") != before
    assert pipeline.run("verify").ran == ("release",)
    assert pipeline.run("verify").facts["clips"] == 2
    assert list(read_lines(pipeline.folder("verify") / "quarantine.jsonl")) == []
