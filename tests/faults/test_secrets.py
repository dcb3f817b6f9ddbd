"""Secrets that a user has, in the environment or by mistake in a URL, stand in nothing that is written or printed."""

import logging

import pytest
from hub_server import hub  # noqa: F401
from remote_release import bucket, store_proxy, store_server  # noqa: F401
from tiny_release import clips, packed_tiny, tiny  # noqa: F401
from typer.testing import CliRunner

from pipelines.cli import app

PLANTED = {
    "AWS_ACCESS_KEY_ID": "AKIAPLANTED000000001",
    "AWS_SECRET_ACCESS_KEY": "planted/secret+key/0000000000000000000002",
    "AWS_SESSION_TOKEN": "planted-session-token-0000000000000000003",
    "HF_TOKEN": "hf_planted00000000000000000000000004",
}
IN_A_URL = "planted-password-05"


@pytest.fixture
def wsm(tmp_path, monkeypatch, bucket, hub):  # noqa: F811
    """Runs a command in an environment full of secrets; everything it says is added to a file that is searched."""
    for name, value in PLANTED.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(tmp_path)

    def call(*words):
        done = CliRunner().invoke(app, [str(word) for word in words])
        with (tmp_path / "printed.txt").open("a") as file:
            file.write(f"{done.output}\n{done.exception!r}\n")
        return done.exit_code

    return call


def found_in(folder):
    """Files below a folder that hold a secret."""
    secrets = [value.encode() for value in (*PLANTED.values(), IN_A_URL)]
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert files
    return [path.name for path in files if any(secret in path.read_bytes() for secret in secrets)]


def test_what_is_published_fetched_and_verified_tells_no_secret(wsm, tiny, bucket, hub, tmp_path, caplog):  # noqa: F811
    caplog.set_level(logging.INFO)
    for url in (f"{bucket[0]}/release", "hf://datasets/someone/homes"):
        assert wsm("publish", tiny.folder, url) == 0
        assert wsm("verify", url, "--no-payload") == 0
        assert wsm("verify", url, "--out", tmp_path / f"verified-{url[:2]}", "-w", "1") == 0
        assert wsm("fetch", url, tmp_path / f"fetched-{url[:2]}") == 0
    assert found_in(tmp_path) == []
    (tmp_path / "log.txt").write_text(caplog.text)
    assert found_in(tmp_path) == []
    stored = [data for files in hub.repositories.values() for data in files.values()]
    name = bucket[0].removeprefix("s3://")
    keys = [one["Key"] for one in bucket[1].list_objects_v2(Bucket=name)["Contents"]]
    stored += [bucket[1].get_object(Bucket=name, Key=key)["Body"].read() for key in keys]
    assert not any(value.encode() in data for value in PLANTED.values() for data in stored)


def test_refusals_of_a_store_tell_no_secret(wsm, tiny, bucket, hub, tmp_path):  # noqa: F811
    hub.token = "another"  # noqa: S105 - of the stand-in
    assert wsm("publish", tiny.folder, "hf://datasets/someone/homes") == 5
    assert wsm("publish", tiny.folder, "s3://absent-bucket/release") == 5
    assert found_in(tmp_path) == []


@pytest.mark.parametrize(
    "words",
    [
        ("publish", "{release}", "ftp://me:{secret}@host/release"),
        ("fetch", "https://host/release?X-Amz-Signature={secret}", "fetched"),
        ("verify", "https://me:{secret}@host/release"),
        ("verify", "https://me:{secret}@host/release", "--out", "verified"),
        ("run", "interndata", "--set", "source=ftp://me:{secret}@host/source", "--out", "run"),
        ("run", "interndata", "--set", "source=here", "--out", "ftp://me:{secret}@host/run", "--work", "work"),
        ("inspect", "ftp://me:{secret}@host/release"),
        ("score", "https://me:{secret}@host/release", "--out", "score"),
        ("index", "--set", "source=ftp://me:{secret}@host/source", "--out", "index"),
        ("publish", "ftp://me:{secret}@host/release", "s3://bucket/release"),
    ],
    ids=lambda words: " ".join(words[:1]),
)
def test_a_password_in_a_url_is_refused_and_not_repeated(wsm, tiny, tmp_path, words):  # noqa: F811
    assert wsm(*(word.format(secret=IN_A_URL, release=tiny.folder) for word in words)) == 2
    assert found_in(tmp_path) == []
