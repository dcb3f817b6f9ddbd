import logging
import shutil
from dataclasses import replace

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.stages import score as stage_module
from pipelines.stages.score import ScoreConfig
from pipelines.stages.verify import VerifyConfig
from wsm_data.access.release import open_release
from wsm_data.codecs.dct import DctCodec
from wsm_data.curation.rollouts import ROLLOUT_SCORES, rollout_schema
from wsm_data.curation.score_clip import CLIP_SCORES, score_clip
from wsm_data.curation.scores_table import read_paths, read_scores
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.shards.manifest import release_digest

NAMES = [one.name for one in CLIP_SCORES]


@pytest.fixture
def release(finished, tmp_path):
    return shutil.copytree(finished.release, tmp_path / "release")


@pytest.fixture
def score(release, tmp_path):
    """Runs the stage over the release; returns its report and the file it wrote."""

    def run(out="score", options=None, **changes):
        config = ScoreConfig(**{"release": str(release), **changes})
        report = run_stage(load_stage("score"), config, tmp_path / out, RunOptions(quiet=True, **(options or {})))
        return report, tmp_path / out / "scores.parquet"

    return run


def read(path, release):
    opened = open_release(release)
    keys = opened.index.columns(["key"])["key"]
    return read_scores(path, release_digest=release_digest(opened.manifest), release_keys=keys)


def test_every_clip_of_the_index_has_its_scores_in_order_and_they_stand_in_the_release(score, release):
    report, path = score()
    assert report.facts == {"clips": 5}
    assert (release / "scores.parquet").read_bytes() == path.read_bytes()
    table, opened = read(path, release), open_release(release)
    outlines = read_paths(path, np.arange(5))
    std = np.array(opened.manifest.rgb_statistics.std)
    for row, key in enumerate(opened.index.texts("key")):
        expected = score_clip(opened.read_clip(key), std, DctCodec(), ScoreConfig(release="").depth_samples)
        assert [table.columns[name][row] for name in NAMES] == list(expected.values.values()), key
        assert outlines.xy_m[row] == pytest.approx(expected.outline_xy_m, abs=1e-5)  # stored as float32
        assert outlines.floor_z_m[row] == pytest.approx(expected.floor_z_m, abs=1e-6)


def test_workers_and_interruptions_change_no_byte(score, monkeypatch):
    _, path = score()
    assert score(out="two", options={"workers": 2})[1].read_bytes() == path.read_bytes()
    report, partial = score(out="bit by bit", options={"limit": 1})
    assert len(report.ran) == 1
    assert not partial.exists()
    calls = 0

    def fail_late(*arguments):
        nonlocal calls
        calls += 1
        if calls > 1:
            raise KeyboardInterrupt
        return score_clip(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(stage_module, "score_clip", fail_late)
        with pytest.raises(KeyboardInterrupt):
            score(out="bit by bit")
    report, whole = score(out="bit by bit")
    assert len(report.ran) == 1
    assert whole.read_bytes() == path.read_bytes()


def test_run_twice_nothing_is_done_and_a_copy_that_is_gone_comes_back(score, release):
    _, path = score()
    written = path.stat().st_mtime_ns
    assert score()[0].ran == ()
    assert path.stat().st_mtime_ns == written
    (release / "scores.parquet").unlink()
    assert score()[0].ran == ()
    assert (release / "scores.parquet").read_bytes() == path.read_bytes()


def test_a_score_of_another_version_is_computed_again(score, monkeypatch):
    score()
    newer = (replace(CLIP_SCORES[0], version=99), *CLIP_SCORES[1:])
    monkeypatch.setattr(stage_module, "CLIP_SCORES", newer)
    assert len(score()[0].ran) == 2


def write_rollouts(path, release, *rows):
    opened = open_release(release)
    safe = {
        "replan_latent": 0,
        "policy": "a",
        "dreams": 4,
        "unsafe_share": 0.5,
        "mean_cost_m2": 1.0,
        "ate_rmse_sim3_m": 0.1,
    }
    records = [{**safe, "fm_loss": 2.0, **row} for row in rows]
    pq.write_table(pa.Table.from_pylist(records, schema=rollout_schema(release_digest(opened.manifest))), path)
    return str(path)


def test_rollouts_add_the_scores_of_models_without_scoring_a_clip_again(score, release, tmp_path):
    score()
    keys = open_release(release).index.texts("key")
    rollouts = write_rollouts(tmp_path / "rollouts.parquet", release, {"key": keys[3]})
    report, path = score(rollouts=rollouts)
    assert report.ran == ()
    table = read(path, release)
    assert list(table.columns) == [*NAMES, *(one.name for one in ROLLOUT_SCORES)]
    assert table.columns["rollout_unsafe_share"][3] == 0.5
    assert np.isnan(table.columns["rollout_unsafe_share"][[0, 1, 2, 4]]).all()
    write_rollouts(tmp_path / "rollouts.parquet", release, {"key": keys[3], "unsafe_share": 0.25})
    report, path = score(rollouts=rollouts)
    assert report.ran == ()
    assert read(path, release).columns["rollout_unsafe_share"][3] == 0.25


def test_rollouts_that_cannot_be_used_are_refused(score, release, tmp_path):
    with pytest.raises(ConfigError, match="no rollouts at"):
        score(rollouts=str(tmp_path / "none.parquet"))
    bad = write_rollouts(tmp_path / "rollouts.parquet", release, {"key": "nobody"})
    with pytest.raises(ConfigError, match="in the row of clip nobody"):
        score(rollouts=bad)


def test_a_damaged_clip_is_named_and_scored_no_further(score, release):
    row = next(open_release(release).index.rows_of_shard("train-000000.tar"))
    member = next(one for one in row.members if one.name == "poses")
    shard = release / row.shard
    data = bytearray(shard.read_bytes())
    data[row.clip_offset + member.array_offset + 50] ^= 1
    shard.write_bytes(data)
    with pytest.raises(IntegrityError, match=f"{row.shard}, clip {row.key}: the checksum of poses.npy"):
        score()


def test_a_release_may_be_left_as_it_is(score, release):
    before = sorted(path.name for path in release.iterdir())
    _, path = score(install=False)
    assert path.exists()
    assert sorted(path.name for path in release.iterdir()) == before


def test_scores_and_selections_are_verified_alone_and_a_damaged_one_is_named(score, release, tmp_path):
    def verify():
        config = VerifyConfig(release=str(release))
        return run_stage(load_stage("verify"), config, tmp_path / "verify", RunOptions(quiet=True)).ran

    assert len(verify()) == 1
    score()
    assert verify() == ("scores.parquet",)
    assert verify() == ()
    (release / "selections").mkdir()
    (release / "selections" / "hard.parquet").write_bytes(b"")
    with pytest.raises(IntegrityError, match=r"attached\.changed: .*selections/hard\.parquet must be a selection"):
        verify()


def test_behind_a_url_the_same_bytes_are_written_and_nothing_is_installed(score, release, caplog):
    remote = "memory://scored"
    fsspec.filesystem("memory").put(str(release), remote, recursive=True)
    try:
        with caplog.at_level(logging.WARNING):
            _, path = score(out="remote", release=remote)
        assert not fsspec.filesystem("memory").exists(f"{remote}/scores.parquet")
    finally:
        fsspec.filesystem("memory").rm(remote, recursive=True)
    assert (
        "scores.parquet will not be copied into memory://scored (it lies behind a URL): name the scores to"
        in caplog.text
    )
    assert path.read_bytes() == score()[1].read_bytes()


def test_a_negative_number_of_decoded_latents_is_refused():
    with pytest.raises(ValueError, match="depth_samples must not be negative, found -1"):
        ScoreConfig(release="r", depth_samples=-1)
