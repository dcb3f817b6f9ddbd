"""`wsm audit`: a table or JSON, and an exit code by severity."""

import json

import pytest
from typer.testing import CliRunner

from pipelines.cli import app
from pipelines.commands.audit import FailOn
from wsm_data.curation.audit.finding import Severity
from wsm_data.shards.manifest import release_digest


@pytest.fixture
def audit(tiny, tmp_path, make_clip):
    """Audits a release in which a held-out trajectory is trained on under another id; returns exit code and output."""
    held_out = tiny.clips[-1]
    copied = make_clip("synth_d435i/home_0003/000099", source_digest=held_out.meta.source_digest)
    tiny.pack(tmp_path / "leaky", [*tiny.clips, copied], shard_bytes=1 << 30)

    def go(*words, folder="leaky"):
        done = CliRunner().invoke(app, ["audit", str(tmp_path / folder), "-q", *words])
        return done.exit_code, done.output

    return go


def test_an_error_ends_with_code_4_and_is_shown_with_its_clips(audit, tiny):
    code, output = audit()
    assert code == 4
    assert "content.duplicate" in output
    assert "2 clips have the same source digest, in the splits test and train" in output
    assert tiny.clips[-1].meta.key in output
    assert "findings of severity error or worse" in output


def test_findings_that_are_mild_enough_end_with_code_0(audit):
    assert audit("--fail-on", "never")[0] == 0


def test_a_shared_scene_fails_where_scenes_were_promised(audit, tiny, make_clip, tmp_path):
    trained, held_out = make_clip("synth_d435i/home_0003/000050"), tiny.clips[-1]  # of one physical scene
    tiny.pack(tmp_path / "shared", [trained, held_out], shard_bytes=1 << 30)
    assert audit(folder="shared")[0] == 0
    code, output = audit("--split-by", "scene", folder="shared")
    assert code == 4
    assert "has clips in several splits: 1 in test, 1 in train" in output
    tiny.pack(tmp_path / "apart", [tiny.clips[0], held_out], shard_bytes=1 << 30)
    assert audit("--split-by", "scene", folder="apart")[0] == 0


def test_json_lists_every_finding(audit, tiny, tmp_path):
    code, output = audit("--json", "--fail-on", "never")
    record = json.loads(output)
    assert code == 0
    assert record["clips"] == len(tiny.clips) + 1
    assert sum(record["counts"].values()) == len(record["findings"])
    assert {"check", "severity", "clips", "message"} == set(record["findings"][0])
    assert record["release_digest"] != release_digest(tiny.manifest)


def test_severities_to_fail_on_are_those_of_findings(audit, tiny, make_clip, tmp_path):
    assert {one.value for one in FailOn} == {one.value for one in Severity} | {"never"}
    clips = [tiny.clips[0], make_clip("synth_d435i/home_0001/000050", map_digest="another map")]  # a warning alone
    tiny.pack(tmp_path / "mild", clips, shard_bytes=1 << 30)
    fail_on = (FailOn.INFO, FailOn.WARNING, FailOn.ERROR, FailOn.NEVER)
    assert [audit("--fail-on", one.value, folder="mild")[0] for one in fail_on] == [4, 4, 0, 0]


def test_a_distance_below_0_is_refused_by_its_option(audit):
    code, output = audit("--near", "-1")
    assert (code, "--near: within_m must be 0 or more" in output) == (2, True)
