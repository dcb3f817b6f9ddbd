"""wsm posttrain on a few homes, with a model of one step: what is written, gone on with, and refused."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from wsm_data.access.release import open_release
from wsm_data.curation.rollouts import read_rollouts
from wsm_model.model_file import load_model

SETTINGS = (
    "order.global_batch=2",
    "queries.future_latents=2",
    "posttraining.session.chunk_size=2",
    "posttraining.group=3",
    "posttraining.flow_steps=2",
    "posttraining.objective.flow_times=1",
    "posttraining.adapters.rank=2",
    "posttraining.adapters.alpha=4",
    "posttraining.optimiser.learning_rate=1e-3",
    "posttraining.optimiser.final_learning_rate=1e-3",
    "posttraining.optimiser.warmup_share=0",
    "measured.queries=2",
)


def posttrain(wsm, trained, out, *settings, model=None, selection="", words=()):
    given = [word for one in (*SETTINGS, *settings) for word in ("--set", one)]
    model = model or trained.model
    return wsm("posttrain", model, trained.release, "--selection", selection, "--out", out, "--quiet", *given, *words)


@pytest.fixture(scope="module")
def posttrained(wsm, trained, tmp_path_factory):
    out = tmp_path_factory.mktemp("posttrained")
    settings = ("posttraining.max_steps=3", "posttraining.sample_every=3")
    code, text = posttrain(wsm, trained, out, *settings, words=("--merge",))
    assert code == 0, text
    return out, text


def test_what_was_measured_before_and_after_is_told_with_intervals(posttrained):
    out, text = posttrained
    found = json.loads((out / "evaluation.json").read_text())
    assert (found["queries"], found["dreams"]) == (2, 3)
    for name in ("before", "after", "difference"):
        for measure in ("mean_reward", "unsafe_share", "success_rate"):
            one = found[name][measure]
            assert one["low"] <= one["value"] <= one["high"]
    difference = found["after"]["mean_reward"]["value"] - found["before"]["mean_reward"]["value"]
    assert found["difference"]["mean_reward"]["value"] == pytest.approx(difference, abs=1e-12)
    assert "mean_reward" in text


def test_a_run_leaves_adapter_model_rollouts_curves_and_pictures(posttrained, trained):
    out, _ = posttrained
    assert (out / "adapter/adapter_model.safetensors").stat().st_size > 0
    assert json.loads((out / "adapter/adapter_config.json").read_text())["r"] == 2
    model, card = load_model(out / "model")
    assert model.config.own_dream_attention
    assert card.releases == load_model(trained.model)[1].releases
    assert (out / "curves.png").stat().st_size > 0
    assert {path.suffix for path in (out / "samples").iterdir()} == {".png", ".mp4"}
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [1, 2, 3]
    assert {"reward", "unsafe_share", "reward_spread", "skipped_share"} <= set(lines[0])


def test_the_rollouts_are_what_curation_reads(posttrained, trained):
    out, _ = posttrained
    release = open_release(trained.release)
    table = read_rollouts(out / "rollouts.parquet", release.digest, release.index)
    assert set(table["dreams"].to_pylist()) == {3}
    assert all(policy.startswith("epoch-") for policy in table["policy"].to_pylist())
    assert np.isfinite(table["fm_loss"].to_numpy()).all()


def test_a_run_goes_on_to_the_same_bits(wsm, trained, posttrained, tmp_path):
    """Its learning rate is constant, so that a run of one step is the beginning of one of three."""
    for steps in (1, 3):
        code, text = posttrain(wsm, trained, tmp_path / "out", f"posttraining.max_steps={steps}")
        assert code == 0, text
    for name in ("adapter/adapter_model.safetensors", "evaluation.json", "rollouts.parquet"):
        assert (tmp_path / "out" / name).read_bytes() == (posttrained[0] / name).read_bytes()


def test_a_run_of_other_settings_is_refused_in_its_folder(wsm, trained, posttrained):
    code, text = posttrain(wsm, trained, posttrained[0], "posttraining.reward.temperature_m2=0.5")
    assert (code, "belongs to another run" in text) == (2, True)


def test_a_dry_run_says_what_would_be_done_and_writes_nothing(wsm, trained, tmp_path):
    code, text = posttrain(wsm, trained, tmp_path / "out", words=("--dry-run",))
    assert code == 0
    assert "parameters that learn:" in text
    assert not (tmp_path / "out").exists()


def test_a_model_of_another_codec_or_without_slam_is_refused(wsm, trained, of_other_latents, tmp_path):
    code, text = posttrain(wsm, trained, tmp_path / "out", model=of_other_latents)
    assert (code, "use a release of the same codec" in " ".join(text.split())) == (2, True)
    folder = Path(shutil.copytree(trained.model, tmp_path / "idm"))
    card = json.loads((folder / "model.json").read_text())
    card["config"]["variant"] = "idm"
    (folder / "model.json").write_text(json.dumps(card))
    code, text = posttrain(wsm, trained, tmp_path / "out", model=folder)
    assert (code, "must be a model with SLAM" in " ".join(text.split())) == (2, True)


@pytest.mark.parametrize(
    ("settings", "selection", "said"),
    [
        ((), "hard", "hard"),
        (("queries.future_latents=4",), "", "queries.future_latents must be the chunk"),
        (("measured.split=train",), "", "must name clips that are not trained on"),
        (("posttraining.group=1",), "", "at least 2 dreams"),
    ],
)
def test_what_does_not_fit_is_refused(wsm, trained, tmp_path, settings, selection, said):
    code, text = posttrain(wsm, trained, tmp_path / "out", *settings, selection=selection)
    assert code == 2
    assert said in " ".join(text.split())
