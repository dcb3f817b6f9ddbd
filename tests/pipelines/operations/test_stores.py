"""`wsm publish`, `wsm fetch` and `wsm verify --no-payload`, as they are typed."""

import fsspec
import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.access.verify import verify_release


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
