import json
import shutil

from typer.testing import CliRunner

from pipelines.cli import app

POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"


def preflight(*words):
    runner = CliRunner(env={"GITHUB_ACTIONS": ""})
    return runner.invoke(app, ["preflight", *map(str, words), "--dataset", "synthetic", "--workers", "1", "--quiet"])


def test_what_to_fetch_again_is_listed_and_a_whole_source_has_nothing(make_source, tmp_path):
    source = shutil.copytree(make_source(), tmp_path / "source")
    again = tmp_path / "again.txt"
    done = preflight(source, "--refetch", again)
    assert (done.exit_code, again.read_text()) == (0, ""), done.output
    first, second = sorted(source.rglob("*.tar.gz"))
    first.write_bytes(POINTER)
    second.write_bytes(second.read_bytes()[:5000])
    done = preflight(source, "--refetch", again, "--json")
    assert done.exit_code == 3, done.output
    assert again.read_text().split() == [path.relative_to(source).as_posix() for path in (first, second)]
    said = json.loads(done.stdout)
    assert [one["reason"] for one in said["findings"]] == ["archive.pointer_file", "archive.truncated"]
    assert [one["walked"] for one in said["units"]] == [True, True]


def test_of_what_is_not_sampled_only_the_ends_are_read(make_source):
    done = preflight(make_source(), "--sample", 0, "--json")
    assert done.exit_code == 0, done.output
    assert [one["bytes_read"] for one in json.loads(done.stdout)["units"]] == [0, 0]


def test_a_share_that_is_none_is_a_wrong_request(make_source):
    assert preflight(make_source(), "--sample", 2).exit_code == 2
