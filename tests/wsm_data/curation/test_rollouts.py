import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wsm_data.access.release import open_release
from wsm_data.curation.rollouts import ROLLOUT_SCORES, read_rollouts, rollout_schema, rollout_scores
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.shards.manifest import release_digest

NAN = float("nan")


@pytest.fixture
def release(tiny):
    return open_release(tiny.folder)


@pytest.fixture
def write(tmp_path, release):
    """Writes a table of rollouts by hand; values that are not given are those of a safe query."""

    def write(*rows, digest=None):
        safe = {
            "policy": "a",
            "dreams": 16,
            "unsafe_share": 0.0,
            "mean_cost_m2": 0.1,
            "ate_rmse_sim3_m": 0.2,
            "fm_loss": 1.0,
        }
        table = pa.Table.from_pylist(
            [{**safe, **row} for row in rows], schema=rollout_schema(digest or release_digest(release.manifest))
        )
        path = tmp_path / "rollouts.parquet"
        pq.write_table(table, path)
        return path

    return write


@pytest.fixture
def keys(release):
    return release.index.texts("key")


def read(path, release):
    return read_rollouts(path, release_digest(release.manifest), release.index)


def scores_of(path, release):
    return rollout_scores(read(path, release), release.index.columns(["key"])["key"])


def test_scores_are_means_over_the_queries_of_all_policies(write, release, keys):
    path = write(
        {"key": keys[2], "replan_latent": 0, "unsafe_share": 0.25, "mean_cost_m2": 1.0},
        {"key": keys[2], "replan_latent": 2, "unsafe_share": 1.0, "mean_cost_m2": None, "ate_rmse_sim3_m": 0.5},
        {"key": keys[2], "replan_latent": 0, "policy": "b", "unsafe_share": 0.25, "mean_cost_m2": 3.0, "fm_loss": 4.0},
        {"key": keys[0], "replan_latent": 1},
    )
    found = scores_of(path, release)
    assert list(found) == [one.name for one in ROLLOUT_SCORES]
    assert {name: values[2] for name, values in found.items()} == pytest.approx(
        {
            "rollout_unsafe_share": 0.5,
            "rollout_all_unsafe": 0.0,
            "rollout_mean_cost_m2": 2.0,  # of the queries with a safe dream
            "rollout_ate_rmse_sim3_m": 0.3,
            "rollout_fm_loss": 2.0,
        }
    )
    assert [values[0] for values in found.values()] == pytest.approx([0.0, 0.0, 0.1, 0.2, 1.0])


def test_a_clip_without_rollouts_has_none_of_the_scores(write, release, keys):
    found = scores_of(write({"key": keys[0], "replan_latent": 0}), release)
    assert all(np.isnan(values[1:]).all() and values.shape == (len(keys),) for values in found.values())


def test_unsafe_for_all_is_every_dream_of_every_query_of_every_policy(write, release, keys):
    hopeless = {"unsafe_share": 1.0, "mean_cost_m2": None}
    path = write(
        {"key": keys[0], "replan_latent": 0, **hopeless},
        {"key": keys[0], "replan_latent": 0, "policy": "b", **hopeless},
        {"key": keys[1], "replan_latent": 0, **hopeless},
        {"key": keys[1], "replan_latent": 0, "policy": "b", "unsafe_share": 0.9375},
    )
    found = scores_of(path, release)
    assert found["rollout_all_unsafe"][:2].tolist() == [1.0, 0.0]
    assert np.isnan(found["rollout_mean_cost_m2"][0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"key": "nobody"}, "must be of a clip of the release, in the row of clip nobody"),
        ({"replan_latent": 99}, "replan_latent must be one of the clip's latents.*replan_latent 99"),
        ({"replan_latent": -1}, "replan_latent must be one of the clip's latents"),
        ({"dreams": 0}, "dreams must be at least 1"),
        ({"unsafe_share": 1.01}, r"unsafe_share must lie in \[0, 1\], found 1.01"),
        ({"unsafe_share": -0.01}, r"unsafe_share must lie in \[0, 1\]"),
        ({"unsafe_share": NAN}, r"unsafe_share must lie in \[0, 1\], found nan"),
        ({"unsafe_share": None}, "unsafe_share must be there"),
        ({"mean_cost_m2": NAN}, "mean_cost_m2 must be a number of at least 0, found nan"),
        ({"mean_cost_m2": None}, "mean_cost_m2 must be null just where no dream is safe"),
        ({"unsafe_share": 1.0}, "mean_cost_m2 must be null just where no dream is safe"),
        ({"ate_rmse_sim3_m": NAN}, "ate_rmse_sim3_m must be a number of at least 0"),
        ({"ate_rmse_sim3_m": -1.0}, "ate_rmse_sim3_m must be a number of at least 0, found -1.0"),
        ({"fm_loss": float("inf")}, "fm_loss must be a number of at least 0, found inf"),
        ({"fm_loss": None}, "fm_loss must be there"),
        ({"policy": None}, "policy must be there"),
    ],
)
def test_a_row_that_says_nothing_usable_is_refused_and_named(write, release, keys, change, message):
    path = write({"key": keys[0], "replan_latent": 0}, {"key": keys[1], "replan_latent": 1, **change})
    with pytest.raises(ConfigError, match=message):
        read(path, release)


def test_a_query_that_stands_there_twice_is_refused(write, release, keys):
    twice = {"key": keys[1], "replan_latent": 1}
    with pytest.raises(ConfigError, match=f"must stand there once, in the row of clip {keys[1]}.*1 rows are like this"):
        read(write({"key": keys[0], "replan_latent": 1}, twice, {**twice, "policy": "b"}, twice), release)


def test_rollouts_of_another_release_are_refused_with_both_digests(write, release, keys):
    path = write({"key": keys[0], "replan_latent": 0}, digest="of-another")
    with pytest.raises(ConfigError, match=f"{release_digest(release.manifest)}, found of-another"):
        read(path, release)


def test_what_is_no_table_of_rollouts_is_told_from_what_is_not_there(tmp_path, release, write, keys):
    with pytest.raises(ConfigError, match="no rollouts"):
        read(tmp_path / "none.parquet", release)
    path = write({"key": keys[0], "replan_latent": 0})
    stored = pq.read_table(path)
    pq.write_table(stored.drop_columns(["fm_loss"]), path)
    with pytest.raises(IntegrityError, match='fm_loss: absent -> "double"'):
        read(path, release)
    pq.write_table(stored.replace_schema_metadata({b"wsm.rollouts": json.dumps({"version": 1})}), path)
    with pytest.raises(IntegrityError, match="version 2, found 1"):
        read(path, release)
    path.write_bytes(b"PAR1 and then nothing")
    with pytest.raises(IntegrityError, match="must be a table of rollouts"):
        read(path, release)
