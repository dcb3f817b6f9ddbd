import json
import shlex
import shutil

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.settings import parse_assignments
from pipelines.stages.score import ScoreConfig
from pipelines.stages.select import SelectConfig, install_selection
from wsm_data.access.release import open_release
from wsm_data.curation.exclusion import ExclusionConfig
from wsm_data.curation.rollouts import rollout_schema
from wsm_data.curation.rule import RuleConfig, RuleKind
from wsm_data.errors import ConfigError
from wsm_data.files.sealed import sealed, unsealed
from wsm_data.files.typed_toml import build_config
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.selection import parse_selection, read_selection

QUIET = RunOptions(quiet=True)


@pytest.fixture
def select(release, tmp_path):
    def go(out="select", options=QUIET, **changes):
        config = SelectConfig(**{"release": str(release), "fraction": 0.5, **changes})
        report = run_stage(load_stage("select"), config, tmp_path / out, options)
        path = tmp_path / out / config.file_name
        install_selection(path, config)  # as the command does
        return report, path

    return go


def test_a_selection_is_written_and_installed_into_its_release(select, release):
    report, path = select()
    found = read_selection(release, "hard", release_digest(open_release(release).manifest))
    assert (release / "selections" / "hard.parquet").read_bytes() == path.read_bytes()
    train = open_release(release).manifest.clips_by_split["train"]
    assert len(found) == report.facts["clips chosen"] == max(1, int(0.5 * train + 0.5))
    assert all(found.why.to_pylist())


def test_the_command_in_the_file_makes_the_same_bytes(select, release, tmp_path):
    weights = {"detour_ratio": 2.0, "path_length_m": 1.0}
    _, path = select(rule=RuleConfig(weights=weights), name="long")
    metadata = read_selection(release, "long", release_digest(open_release(release).manifest))
    words = shlex.split(metadata.command)
    assert words[:3] == ["wsm", "select", "RELEASE"]
    config = build_config(SelectConfig, {"release": str(release), **parse_assignments(words[4::2])})
    run_stage(load_stage("select"), config, tmp_path / "again", QUIET)
    assert (tmp_path / "again" / "long.parquet").read_bytes() == path.read_bytes()


def test_scored_and_selected_with_any_number_of_workers_the_bytes_are_the_same(select, release, tmp_path):
    found = []
    for workers in (1, 2):
        options, out = RunOptions(quiet=True, workers=workers), tmp_path / f"score{workers}"
        report = run_stage(load_stage("score"), ScoreConfig(release=str(release), install=False), out, options)
        assert len(report.ran) == 2  # as many shards, so that two workers share them
        found.append(select(f"select{workers}", options, scores=str(out / "scores.parquet"))[1].read_bytes())
    assert found[0] == found[1]


def test_the_command_says_that_other_scores_were_named_and_not_where_they_lie(select, release, tmp_path):
    scores = shutil.copy(release / "scores.parquet", tmp_path / "elsewhere.parquet")
    _, path = select(scores=str(scores))
    assert parse_selection(path.read_bytes(), "here").command == (
        "wsm select RELEASE --set fraction=0.5 --set scores=SCORES"
    )


def test_a_rule_by_rollouts_that_were_never_made_says_to_evaluate_a_policy_first(select):
    with pytest.raises(ConfigError, match=r"'rollout_unsafe_share' \(from rollouts: evaluate a policy first\)"):
        select(rule=RuleConfig(kind=RuleKind.LEXICOGRAPHIC))


def test_with_few_rollouts_the_others_are_left_out_where_that_is_asked_for(select, release, tmp_path):
    opened = open_release(release)
    train = opened.index.columns(["key"]).filter(pc.equal(opened.index.columns(["split"])["split"], "train"))
    row = {
        "replan_latent": 0,
        "policy": "a",
        "dreams": 4,
        "unsafe_share": 0.5,
        "mean_cost_m2": 1.0,
        "ate_rmse_sim3_m": 0.1,
    }
    records = [{"key": train["key"][0].as_py(), **row, "fm_loss": 2.0}]
    schema = rollout_schema(release_digest(opened.manifest))
    pq.write_table(pa.Table.from_pylist(records, schema=schema), tmp_path / "rollouts.parquet")
    config = ScoreConfig(release=str(release), rollouts=str(tmp_path / "rollouts.parquet"))
    run_stage(load_stage("score"), config, tmp_path / "score", QUIET)
    rule = RuleConfig(kind=RuleKind.LEXICOGRAPHIC)
    with pytest.raises(ConfigError, match=r"clips have none of the scores of the rule .*exclude\.unscored=true"):
        select(rule=rule, fraction=0.01)
    _, path = select(out="some", rule=rule, fraction=0.01, exclude=ExclusionConfig(unscored=True))
    found = parse_selection(path.read_bytes(), "here")
    assert found.keys.to_pylist() == [records[0]["key"]]
    assert found.rule["clips"]["excluded"]["having no score of the rule"] == len(train) - 1


def test_a_selection_of_the_same_name_and_other_settings_is_replaced_aloud(select, release, caplog):
    select()
    select()
    assert caplog.text == ""
    _, path = select(out="other", fraction=0.25)
    assert "is replaced by a selection with other settings: fraction: 0.5 -> 0.25" in caplog.text
    assert (release / "selections" / "hard.parquet").read_bytes() == path.read_bytes()


def test_what_is_no_selection_is_replaced_aloud(select, release, caplog):
    (release / "selections").mkdir(exist_ok=True)
    (release / "selections" / "hard.parquet").write_bytes(b"torn")
    _, path = select()
    assert "must be a selection" in caplog.text
    assert (release / "selections" / "hard.parquet").read_bytes() == path.read_bytes()


def test_the_place_of_the_release_does_not_show(select, release, tmp_path):
    _, here = select(out="here")
    moved = shutil.move(release, tmp_path / "moved")
    _, there = select(out="there", release=str(moved))
    assert here.read_bytes() == there.read_bytes()


def test_every_setting_stands_in_the_file_and_what_became_of_the_clips(select, release):
    select()
    rule = read_selection(release, "hard", release_digest(open_release(release).manifest)).rule
    assert set(rule["settings"]) == {"diversity", "exclude", "fraction", "name", "quotas", "rule", "split"}
    assert set(rule["settings"]["rule"]["weights"]) <= set(rule["scores"])
    assert rule["clips"]["chosen"] + rule["clips"]["near-duplicates left out"] <= rule["clips"]["of the split"]


def test_a_second_run_has_nothing_to_do_and_new_scores_are_noticed(select, release):
    assert select()[0].ran == ("selection",)
    assert select()[0].ran == ()
    path = release / "scores.parquet"
    table = pq.read_table(path)
    column = table.schema.get_field_index("detour_ratio")
    changed = pa.array(table["detour_ratio"].to_numpy()[::-1].copy())
    pq.write_table(table.set_column(column, table.schema.field(column), changed), path)
    assert select()[0].ran == ("selection",)


def test_scores_of_another_release_are_refused_with_what_differs(select, release, tmp_path):
    table = pq.read_table(release / "scores.parquet").slice(1)
    stated = unsealed(json.loads(table.schema.metadata[b"wsm.scores"])) | {"release_digest": "0" * 64}
    other = table.replace_schema_metadata({b"wsm.scores": json.dumps(sealed(stated))})
    pq.write_table(other, tmp_path / "other.parquet")
    with pytest.raises(
        ConfigError, match=r"(?s)of another release.*release digest: 0{64} -> .*clips: 4 -> 5.*added: 1"
    ):
        select(scores=str(tmp_path / "other.parquet"))


@pytest.mark.parametrize("name", ["detour_ratio", "goal_reachable"])
def test_a_score_that_is_nan_is_refused_by_its_name(select, release, name):
    path = release / "scores.parquet"
    table = pq.read_table(path)
    values = table[name].to_numpy().copy()
    values[2] = np.nan
    column = table.schema.get_field_index(name)
    pq.write_table(table.set_column(column, table.schema.field(column), pa.array(values)), path)
    with pytest.raises(ConfigError, match=f"the score {name} of clip .* must be a number, found NaN"):
        select()


def test_missing_scores_say_what_to_run(select, release):
    (release / "scores.parquet").unlink()
    with pytest.raises(ConfigError, match=r"no scores at .*; run `wsm score RELEASE` first"):
        select()


def test_an_unknown_score_in_a_rule_is_refused_by_its_name(select):
    with pytest.raises(ConfigError, match=r"'detuor_ratio'.*did you mean detour_ratio"):
        select(rule=RuleConfig(weights={"detuor_ratio": 1.0}))


def test_other_settings_in_the_same_folder_are_refused_with_the_difference(select):
    select()
    with pytest.raises(ConfigError, match=r"fraction: 0\.5 -> 0\.25"):
        select(fraction=0.25)


def test_a_selection_that_was_removed_from_its_release_is_put_back(select, release):
    _, path = select()
    installed = release / "selections" / "hard.parquet"
    installed.unlink()
    install_selection(path, SelectConfig(release=str(release)))
    assert installed.read_bytes() == path.read_bytes()


def test_behind_a_url_nothing_is_installed(select):
    _, path = select()
    install_selection(path, SelectConfig(release="memory://release"))
    assert not fsspec.filesystem("memory").exists("memory://release/selections/hard.parquet")
