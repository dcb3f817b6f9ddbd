import json
import os
import signal
import socket
import subprocess
import sys

import httpx
import pytest

from pipelines.operations.clips.view import serve_pages, shown
from wsm_data.errors import ConfigError
from wsm_data.view.browser.app import Shown


@pytest.fixture(scope="module")
def run(homes_release):
    return homes_release.parents[1]


def test_a_release_a_run_and_a_source_are_told_apart(run, homes_release, make_source):
    release = shown(str(homes_release), "", "", "")
    assert (release.release is not None, release.source, release.title) == (True, None, release.release.about()["name"])
    whole = shown(str(run), str(homes_release), "", "")
    assert whole.source.about()["dataset"] == "synthetic"
    assert whole.other.about() == whole.release.about() == release.release.about()
    source = shown(str(make_source()), "", "synthetic", "")
    assert (source.release, source.source.about()["containers"]) == (None, 2)


def test_a_run_that_is_not_packed_yet_shows_what_its_stages_refused(make_source, run_pipeline, tmp_path):
    run_pipeline(make_source(), tmp_path, stages=("index",))
    pages = shown(str(tmp_path), "", "", "")
    assert (pages.release, len(pages.refusals)) == (None, 0)
    line = {"unit": "a/b/c", "source": "a/b", "reason": "pose.jump", "message": "m", "details": {"frame": 3}}
    line |= {"stage": "index", "stage_version": 1, "fingerprint": "f", "time": 1.0}
    (tmp_path / "index" / "quarantine.jsonl").write_text(json.dumps(line) + "\n")
    [refusal] = shown(str(tmp_path), "", "", "").refusals
    assert (refusal["unit"], refusal["reason"], refusal["stage"]) == ("a/b/c", "pose.jump", "index")


def test_what_cannot_be_shown_is_refused(tmp_path, make_source):
    with pytest.raises(ConfigError, match="there is no folder"):
        shown(str(tmp_path / "none"), "", "", "")
    with pytest.raises(ConfigError, match="none fits"):
        shown(str(tmp_path), "", "", "")
    with pytest.raises(ConfigError, match="--beside x is for a release"):
        shown(str(make_source()), "x", "synthetic", "")


def test_a_port_that_is_taken_is_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ConfigError, match="--port must be free"):
            serve_pages(Shown(title="t"), taken.getsockname()[1])


def test_the_command_serves_on_the_loopback_alone_until_it_is_told_to_end(homes_release):
    command = [sys.executable, "-m", "pipelines.cli", "view", str(homes_release), "--port", "0"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            address = process.stdout.readline().split()[1]
            assert address.startswith("http://127.0.0.1:")
            assert httpx.get(f"{address}api/clips?limit=1", timeout=60).json()["total"] == 12
            assert httpx.get(address, headers={"Host": "evil.example"}).status_code == 403
            port = int(address.rstrip("/").rpartition(":")[2])
            with socket.socket() as other:  # another address of this machine, which 0.0.0.0 would answer at
                assert other.connect_ex(("127.0.0.2", port)) != 0
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.stdout.read() == "stopped\n"
    assert process.returncode == 0
