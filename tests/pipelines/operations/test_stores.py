"""`wsm publish`, `wsm fetch` and `wsm verify --no-payload`, as they are typed."""

import fsspec
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.verify import verify_release
from wsm_data.files.digest import sha256_bytes
from wsm_data.shards.inventory import InventoryRow, UnitState


def wsm(*words, code=0):
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == code, done.output
    return " ".join(done.output.split())


@pytest.fixture
def url(tmp_path):
    return f"memory://typed-{tmp_path.name}"


def test_a_release_goes_to_a_store_is_looked_at_and_comes_back(tiny, url, tmp_path):
    assert f"{url} holds tiny, 7 clips: 7 of 7 files were sent" in wsm("publish", tiny.folder, url, "-q")
    assert "0 of 7 files were sent" in wsm("publish", tiny.folder, url, "-q")
    assert "has all 3 shards in their sizes, none by a checksum" in wsm("verify", url, "--no-payload")
    assert "is whole: 7 clips" in wsm("verify", url, "-q")
    assert "7 of 7 files came" in wsm("fetch", url, tmp_path / "back", "-q")
    assert verify_release(tmp_path / "back") == []


def test_a_lost_shard_is_an_error_of_integrity(tiny, url):
    wsm("publish", tiny.folder, url, "-q")
    fsspec.filesystem("memory").rm(f"/{url.removeprefix('memory://')}/{tiny.manifest.shards[0].name}")
    assert f"shard.missing: {tiny.manifest.shards[0].name}" in wsm("verify", url, "--no-payload", code=4)


def test_a_path_is_no_place_to_publish_to(tiny, tmp_path):
    assert "is published to a URL" in wsm("publish", tiny.folder, tmp_path / "there", code=2)


def test_a_url_is_no_release_to_publish_and_no_folder_to_fetch_into(url):
    assert "must be a path on this machine" in wsm("publish", url, url, code=2)
    assert "must be a path on this machine" in wsm("fetch", url, url, code=2)


def test_options_that_would_do_nothing_are_refused(tiny, tmp_path):
    assert "--limit would do nothing" in wsm("verify", tiny.folder, "--no-payload", "--limit", 3, code=2)
    assert "records nothing" in wsm("verify", tiny.folder, "--no-payload", "--out", tmp_path / "v", code=2)


def test_a_merge_needs_two_releases_and_a_folder_of_its_own(tiny, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    assert "two releases at least" in wsm("merge", tiny.folder, "--out", tmp_path / "c", code=2)
    assert "must be empty" in wsm("merge", tiny.folder, tiny.folder, "--out", tmp_path / "mine", code=2)
    assert "is one of the releases" in wsm("merge", tiny.folder, tiny.folder, "--out", tiny.folder, code=2)
    assert "no unit in common" in wsm("merge", tiny.folder, tiny.folder, "--out", tmp_path / "c", code=2)


def test_two_releases_become_one_that_is_whole(tiny, make_clip, tmp_path):
    digest = sha256_bytes(b"another")[:32]
    tiny.pack(
        tmp_path / "other",
        [make_clip("synth_d435i/home_0044/000001", source_digest=digest)],
        shard_bytes=200_000,
        refusals=(),
        inventory=[
            InventoryRow(
                unit="synth_d435i/home_0044/000001",
                container="synth_d435i/home_0044",
                state=UnitState.CLIP,
                split="train",
                source_digest=digest,
            )
        ],
    )
    said = wsm("merge", tiny.folder, tmp_path / "other", "--out", tmp_path / "both", "--name", "both")
    assert "holds both, 8 clips of 2 releases, and is whole" in said
