"""wsm train --init: runs that begin with the weights of another."""

import json
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_model.model_file import load_card
from wsm_model.training.checkpoint import checkpoints

torch.set_num_threads(1)

SHORT = ("--quiet", "-s", "order.global_batch=2", "-s", "order.max_latents=3", "-s", "held_out.clips=0")
FLOAT = ("-s", "training.precision=float32")
ONE_STEP = (*SHORT, *FLOAT, "-s", "training.max_steps=1")


def wsm(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def release(homes_release) -> str:
    return str(homes_release)


@pytest.fixture(scope="module")
def first(release, tmp_path_factory) -> Path:
    """A run of two steps that keeps an average, and a checkpoint of each step."""
    out = tmp_path_factory.mktemp("first") / "run"
    steps = ("-s", "training.max_steps=2", "-s", "training.checkpoint_every=1", "-s", "training.ema_decay=0.9")
    code, text = wsm("train", release, "--out", str(out), *SHORT, *FLOAT, *steps)
    assert code == 0, text
    return out


def start_of(release: str, init: Path, out: Path) -> dict[str, torch.Tensor]:
    """First weights of a run: one whose only step has a rate that changes no number that is not tiny."""
    still = ("-s", "training.optimiser.learning_rate=1e-30", "-s", "training.optimiser.final_learning_rate=1e-30")
    code, text = wsm("train", release, "--out", str(out), "--init", str(init), *ONE_STEP, *still)
    assert code == 0, text
    return load_file(out / "model" / "model.safetensors")


@pytest.mark.parametrize("place", ["", "model", "checkpoints/step-000002"])
def test_a_run_begins_with_the_averaged_weights_of_model_run_or_checkpoint(release, first, tmp_path, place):
    found = start_of(release, first / place, tmp_path / "run")
    wanted = load_file(first / "model" / "model.safetensors")
    assert set(found) == set(wanted)
    for name, tensor in wanted.items():
        torch.testing.assert_close(found[name], tensor, rtol=0, atol=1e-25)


def test_of_a_run_that_has_no_model_yet_its_last_checkpoint_is_taken(release, first, tmp_path):
    running = tmp_path / "running"
    shutil.copytree(first, running)
    shutil.rmtree(running / "model")
    (running / "checkpoints" / "step-000002" / "state.json").unlink()
    found = start_of(release, running, tmp_path / "run")
    other = load_file(first / "model" / "model.safetensors")
    assert any(not torch.allclose(found[name], other[name], rtol=0, atol=1e-25) for name in other)


def test_it_takes_the_standard_of_the_weights_and_no_moments_steps_or_place_in_the_data(release, first, tmp_path):
    out = tmp_path / "run"
    code, text = wsm("train", release, "--out", str(out), "--init", str(first), *ONE_STEP)
    assert code == 0, text
    assert json.loads((out / "run.json").read_text())["read"]["standard"]["codec"] == "dct"
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [1]
    assert {"latents_per_second", "tokens_per_second", "tflop_per_second", "peak_memory_gib"} <= set(lines[0])
    assert load_card(out / "model").standard == load_card(first / "model").standard
    assert [path.name for path in checkpoints(out / "checkpoints")] == ["step-000001"]


def test_the_run_goes_on_where_the_folder_it_began_with_is_gone(release, first, tmp_path):
    source, out = tmp_path / "source", tmp_path / "run"
    shutil.copytree(first, source)
    words = ("train", release, "--out", str(out), "--init", str(source), *SHORT, *FLOAT)
    assert wsm(*words, "-s", "training.max_steps=1")[0] == 0
    shutil.rmtree(source)
    code, text = wsm(*words, "-s", "training.max_steps=2")
    assert code == 0, text


def test_an_average_that_is_resumed_ends_in_the_same_bits(release, first, tmp_path):
    out = tmp_path / "resumed"
    words = ("train", release, "--out", str(out), *SHORT, *FLOAT, "-s", "training.ema_decay=0.9")
    shutil.copytree(first, out)
    shutil.rmtree(out / "model")
    shutil.rmtree(out / "checkpoints" / "step-000002")
    code, text = wsm(*words, "-s", "training.max_steps=2", "-s", "training.checkpoint_every=1")
    assert code == 0, text
    found, wanted = (load_file(one / "model" / "model.safetensors") for one in (out, first))
    assert all(torch.equal(found[name], wanted[name]) for name in wanted)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--init", "nowhere"), "must be the folder of a model, of a run"),
        (("--init", "FIRST", "-s", "model.size=small"), "generation.width: 192 -> 768"),
        (("--init", "FIRST", "-s", "model.prediction=velocity"), 'prediction: "clean" -> "velocity"'),
        (("--init", "FIRST", "-s", "model.weights=wan"), "from `weights` or from `init`, not from both"),
    ],
)
def test_weights_that_do_not_fit_are_refused_by_name(release, first, tmp_path, words, message):
    given = [str(first) if word == "FIRST" else word for word in words]
    code, text = wsm("train", release, "--out", str(tmp_path / "run"), *ONE_STEP, *given)
    assert code == 2, text
    assert message in text


def test_weights_of_another_codec_or_another_range_of_depth_are_refused(release, first, tmp_path):
    for change, message in (
        ({"standard": {"codec_digest": "other"}}, "cannot be standardised by the numbers of dct"),
        ({"depth_range": {"min_m": 0.2, "max_m": 9.0}}, "depth latents must stand for what the weights learned"),
    ):
        model = tmp_path / message[:5]
        shutil.copytree(first / "model", model)
        card = json.loads((model / "model.json").read_text())
        for name, value in change.items():
            card[name] = card[name] | value
        (model / "model.json").write_text(json.dumps(card))
        code, text = wsm("train", release, "--out", str(tmp_path / "run"), "--init", str(model), *ONE_STEP)
        assert code == 2, text
        assert message in text
