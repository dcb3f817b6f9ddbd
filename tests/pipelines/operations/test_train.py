"""wsm train, from a release to a model, in one process and in two."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_model.model_file import load_model
from wsm_model.training.checkpoint import checkpoints

torch.set_num_threads(1)

SETTINGS = """
[order]
global_batch = 2
max_latents = 4

[training]
max_steps = 3
precision = "float32"
checkpoint_every = 2
sample_every = 2

[training.optimiser]
learning_rate = 1e-3
final_learning_rate = 1e-4

[held_out]
clips = 1
max_latents = 6
"""


@pytest.fixture(scope="module")
def release(homes_release) -> str:
    """A small release of generated homes."""
    return str(homes_release)


@pytest.fixture(scope="module")
def settings(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("settings") / "train.toml"
    path.write_text(SETTINGS)
    return str(path)


@pytest.fixture(scope="module")
def trained(release, settings, tmp_path_factory) -> tuple[Path, str]:
    """The folder of a run that came to its end, and what it said."""
    out = tmp_path_factory.mktemp("trained") / "run"
    code, text = wsm("train", release, "--out", str(out), "-c", settings, "--quiet")
    assert code == 0, text
    return out, text


def wsm(*words: str) -> tuple[int, str]:
    """Exit code and output of a command in this process."""
    done = CliRunner().invoke(app, list(words))
    return done.exit_code, done.output


def lines_of(out: Path) -> list[dict[str, float]]:
    """Metrics of a run: a line a step, and one more with every picture."""
    return [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]


def test_a_run_leaves_model_metrics_pictures_ledger_and_evaluation(release, trained):
    out, text = trained
    assert "camera ATE, not aligned (m)" in text
    metrics = lines_of(out)
    assert [line["step"] for line in metrics if "loss" in line] == [1, 2, 3]
    assert [line["step"] for line in metrics if "held_out_depth_abs_rel" in line] == [2]
    assert {"loss", "flow", "depth", "pose_absolute", "pose_relative", "gradient_norm"} <= set(metrics[0])
    assert (out / "samples" / "step-000002.png").stat().st_size > 10_000
    assert (out / "curves.png").exists()
    assert list((out / "tensorboard").iterdir())
    evaluation = json.loads((out / "evaluation.json").read_text())
    assert set(evaluation["flow"]) == {"model", "copy", "unconditional"}
    _, card = load_model(out / "model")
    assert card.steps == 3
    audited, said = wsm("audit-run", str(out / "ledger"), "--release", release)
    assert audited == 0, said


def test_the_same_command_again_trains_no_step_more(release, settings, trained):
    out, _ = trained
    code, text = wsm("train", release, "--out", str(out), "-c", settings, "--quiet")
    assert code == 0, text
    assert [line["step"] for line in lines_of(out)] == [1, 2, 2, 3]
    assert [path.name for path in checkpoints(out / "checkpoints")] == ["step-000002", "step-000003"]


def test_a_run_that_is_done_goes_on_where_more_steps_are_asked_for(release, settings, trained, tmp_path):
    out = tmp_path / "longer"
    shutil.copytree(trained[0], out)
    code, text = wsm("train", release, "--out", str(out), "-c", settings, "-s", "training.max_steps=4", "--quiet")
    assert code == 0, text
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines if "loss" in line] == [1, 2, 3, 4]
    assert load_model(out / "model")[1].steps == 4


def test_other_settings_in_the_same_folder_are_refused(release, settings, trained):
    out, _ = trained
    code, text = wsm("train", release, "--out", str(out), "-c", settings, "-s", "training.seed=5", "--quiet")
    assert code == 2
    assert "training.seed: 0 -> 5" in text


def test_a_dry_run_says_sizes_and_writes_nothing(release, settings, tmp_path):
    out = tmp_path / "run"
    code, text = wsm("train", release, "--out", str(out), "-c", settings, "--dry-run")
    assert code == 0, text
    assert "steps: 3" in text
    assert "model: tiny, 6 layers" in text
    assert "moments of AdamW" in text
    assert re.search(r"a step: .* TFLOP, .* s at 35% of 8 x 989 TFLOP/s", text)
    assert not out.exists()


def test_a_dry_run_refuses_what_cannot_fit_unless_it_is_told_to_print_it_anyway(release, settings, tmp_path):
    """16 bytes a parameter of 5.7 million on one GPU are 0.09 GiB, the reserve is left out, and 0.05 GiB are given."""
    small = ("-s", "hardware.gpus=1", "-s", "hardware.memory_gib=0.05", "-s", "hardware.reserve_gib=0.0")
    words = ("train", release, "--out", str(tmp_path / "run"), "-c", settings, "--dry-run", *small)
    code, text = wsm(*words)
    assert code == 2, text
    assert "a GPU of 0.05 GiB" in text
    assert wsm(*words, "--anyway")[0] == 0


def test_settings_may_be_a_packaged_recipe_and_a_name_that_is_none_lists_them(release, tmp_path):
    words = ("train", release, "--out", str(tmp_path / "run"), "--dry-run", "-s", "order.global_batch=2")
    code, text = wsm(*words, "-c", "small_1x24gb")
    assert code == 0, text
    assert "of 23.5" in text
    code, text = wsm(*words, "-c", "small_2x24gb")
    assert code == 2
    assert "or one of small_1x24gb, wsm5b_48x80gb, wsm5b_8x80gb" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "must know what to train on"),
        (("RELEASE", "-s", "model.size=tinny"), "did you mean tiny"),
        (("RELEASE", "-s", "order.global_batch=1000"), "do not fill a global batch"),
        (("RELEASE", "-s", "training.maxsteps=3"), "unknown key training.maxsteps"),
        (("RELEASE", "-s", "model.weights=nowhere", "-s", "order.global_batch=2"), "must hold diffusion_pytorch_model"),
    ],
)
def test_a_wrong_request_ends_with_code_2_before_any_step(release, tmp_path, words, message):
    given = [release if word == "RELEASE" else word for word in words]
    code, text = wsm("train", *given, "--out", str(tmp_path / "run"), "--quiet", "-s", "training.max_steps=1")
    assert code == 2, text
    assert message in text


def test_a_missing_extra_is_named(release, tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "tensorboard" else object())
    code, text = wsm("train", release, "--out", str(tmp_path / "run"))
    assert code == 2
    assert "needs tensorboard: install the extra in a clone with: pip install -e '.[train]'" in text


@pytest.mark.slow
def test_two_processes_train_the_model_that_one_trains(release, settings, tmp_path):
    """FSDP2 over gloo; pictures are drawn by both. Equal to the rounding of float32 in three steps."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    command = [
        sys.executable,
        "-m",
        "torch.distributed.run",
        "--standalone",
        "--nproc-per-node",
        "2",
        "-m",
        "pipelines.cli",
    ]
    words = ["train", release, "-c", settings, "--quiet", "--out"]
    two = [*command, *words, str(tmp_path / "two")]
    done = subprocess.run(two, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    code, text = wsm(*words, str(tmp_path / "one"))
    assert code == 0, text
    models = [load_model(Path(tmp_path / name) / "model")[0] for name in ("one", "two")]
    for first, second in zip(*(model.parameters() for model in models), strict=True):
        torch.testing.assert_close(second, first, rtol=0, atol=1e-5)
    assert (tmp_path / "two" / "samples" / "step-000002.png").exists()
