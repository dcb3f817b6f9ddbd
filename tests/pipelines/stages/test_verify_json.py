import json

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.shards.names import MANIFEST_NAME


def verify(*words: object):
    answer = CliRunner().invoke(app, ["verify", *map(str, words), "--json", "--quiet"])
    return answer.exit_code, json.loads(answer.stdout) if answer.stdout else None, answer.stderr


@pytest.mark.parametrize("option", ["--payload", "--no-payload"])
def test_a_whole_release_has_no_findings(release, option):
    code, record, _ = verify(release, option)
    assert code == 0
    assert record == {"release": str(release), "payload": option == "--payload", "whole": True, "findings": []}


def test_every_finding_is_a_record_and_the_exit_code_is_that_of_damage(release):
    shard = next(release.glob("*.tar"))
    data = bytearray(shard.read_bytes())
    data[1000] ^= 1
    shard.write_bytes(data)
    code, record, error = verify(release)
    assert (code, record["whole"]) == (4, False)
    found = [(one["kind"], one["shard"]) for one in record["findings"]]
    assert found == [("clip.payload", shard.name), ("shard.changed", shard.name)]
    assert "2 findings" in error


def test_an_unfinished_release_and_damaged_scores_are_findings_too(release):
    scores = release / "scores.parquet"
    scores.write_bytes(scores.read_bytes()[:-100])
    assert [one["kind"] for one in verify(release)[1]["findings"]] == ["attached.changed"]
    (release / MANIFEST_NAME).unlink()
    assert [one["kind"] for one in verify(release)[1]["findings"]] == ["release.unreadable"]


def test_a_record_and_json_are_not_both_written(release, tmp_path):
    code, record, error = verify(release, "--out", tmp_path / "out")
    assert (code, record) == (2, None)
    assert "--json is for a release that is verified without a record" in error
