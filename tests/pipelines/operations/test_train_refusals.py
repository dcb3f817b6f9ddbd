"""What ends `wsm train`, with which code and words, and what stays on disk; and the variant without SLAM, from end to
end."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
from tiny_release import pack
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.codecs.dct import DctCodec
from wsm_data.files.digest import sha256_file
from wsm_data.shards.manifest import manifest_bytes
from wsm_data.shards.statistics import LatentStatistics
from wsm_model.model_file import load_card
from wsm_model.training.checkpoint import checkpoints

torch.set_num_threads(1)

SETTINGS = (
    "order.global_batch=2",
    "training.max_steps=3",
    "training.precision=float32",
    "training.checkpoint_every=1",
    "held_out.clips=1",
)


@pytest.fixture
def tiny(tmp_path, clips) -> SimpleNamespace:
    """The tiny release with a codec that there is: what a model dreams is decoded to be measured."""
    codec, folder = DctCodec().describe(), tmp_path / "release"
    own = [replace(clip, meta=replace(clip.meta, codec_digest=codec.digest)) for clip in clips]
    return SimpleNamespace(
        folder=folder, manifest=pack(folder, own, shard_bytes=200_000, codec=codec), codec=codec, clips=own
    )


@pytest.fixture
def run(tiny, tmp_path) -> Callable[..., SimpleNamespace]:
    """`wsm train` in one folder over the tiny release, or another; returns code, output, and the folder."""
    out = tmp_path / "run"

    def train(*assignments: str, release: Path | None = None, sources: str = "") -> SimpleNamespace:
        words = ["train", *([] if sources else [str(release or tiny.folder)]), "--out", str(out), "--quiet"]
        for assignment in (*SETTINGS, *([sources] if sources else []), *assignments):
            words += ["-s", assignment]
        done = CliRunner().invoke(app, words)
        return SimpleNamespace(code=done.exit_code, text=done.output, out=out, kept=kept(out))

    return train


def kept(out: Path) -> dict[str, str]:
    """Digests of all files of the finished checkpoints."""
    files = [file for folder in checkpoints(out / "checkpoints") for file in folder.iterdir()]
    return {str(file.relative_to(out)): sha256_file(file) for file in files}


def copy_with(tiny: SimpleNamespace, **changes: object) -> Path:
    """A copy of the tiny release whose manifest says something else."""
    other = Path(shutil.copytree(tiny.folder, tiny.folder.with_name("other")))
    (other / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, **changes)))
    return other


def test_without_slam_a_run_goes_to_its_end(run):
    done = run("model.variant=idm", "training.max_steps=2")
    assert done.code == 0, done.text
    metrics = [json.loads(line) for line in (done.out / "metrics.jsonl").read_text().splitlines()]
    assert "depth" not in metrics[0]
    assert "flow matching" in done.text
    assert "camera ATE" not in done.text
    assert load_card(done.out / "model").config.variant == "idm"


def test_a_run_that_becomes_infinite_ends_with_code_6_and_keeps_the_last_good_checkpoint(run):
    wild = ("training.optimiser.learning_rate=1e30", "training.optimiser.final_learning_rate=1e29")
    done = run(*wild, "training.max_steps=5", "training.optimiser.warmup_share=0.0")
    assert done.code == 6, done.text
    assert "epoch 0, step 1: losses and gradients must be finite" in done.text
    assert "synth_" in done.text  # the clips by their keys
    assert "Nothing was written over the last checkpoint" in done.text
    assert [path.name for path in checkpoints(done.out / "checkpoints")] == ["step-000001"]
    assert not (done.out / "model").exists()
    again = run(*wild, "training.max_steps=5", "training.optimiser.warmup_share=0.0")
    assert again.code == 6
    assert again.kept == done.kept


def test_another_release_in_the_same_folder_is_refused_and_nothing_is_overwritten(run, tiny):
    first = run()
    assert first.code == 0, first.text
    again = run(release=copy_with(tiny, name="offices"))
    assert again.code == 2, again.text
    assert tiny.manifest.name in again.text
    assert again.kept == first.kept


def test_another_model_in_the_same_folder_is_refused_by_field(run):
    first = run()
    again = run("model.variant=idm")
    assert again.code == 2
    assert 'model.variant: "slam" -> "idm"' in again.text
    assert again.kept == first.kept
    assert json.loads((first.out / "run.json").read_text())["model"]["variant"] == "slam"


def test_latents_of_another_dtype_in_the_same_folder_are_refused(run):
    run()
    again = run("read.dtype=bfloat16")
    assert again.code == 2
    assert 'dtype_of_latents: "float32" -> "bfloat16"' in again.text


def test_pictures_of_a_split_without_clips_are_refused_before_the_first_step(run):
    done = run("training.sample_every=2", "held_out.split=val")
    assert done.code == 2, done.text
    assert "pictures need a clip of the split 'val'" in done.text
    assert not (done.out / "checkpoints").exists()


def test_a_damaged_checkpoint_ends_with_code_4_and_once_it_is_deleted_the_one_before_leads_to_the_same_model(run):
    first = run("training.keep_checkpoints=2")
    assert first.code == 0, first.text
    model = sha256_file(first.out / "model" / "model.safetensors")
    last = checkpoints(first.out / "checkpoints")[-1]
    (tensors,) = last.glob("*.safetensors")
    tensors.write_bytes(tensors.read_bytes()[:-1000])
    again = run("training.keep_checkpoints=2")
    assert again.code == 4, again.text
    assert "step-000003 must be a whole checkpoint, but:" in again.text
    assert "delete it to go on from the one before" in again.text
    shutil.rmtree(last)
    shutil.rmtree(first.out / "model")
    repaired = run("training.keep_checkpoints=2")
    assert repaired.code == 0, repaired.text
    assert sha256_file(first.out / "model" / "model.safetensors") == model  # the last step was done again, to the bit


def test_missing_statistics_and_two_codecs_end_with_code_2_before_any_step(run, tiny):
    empty = LatentStatistics(mean=(), std=(), count=0)
    without = copy_with(tiny, rgb_statistics=empty, depth_statistics=empty)
    done = run(release=without)
    assert done.code == 2
    assert "must have latent statistics to standardise by" in done.text
    codec = replace(tiny.codec, digest="another")
    (without / "dataset.json").write_bytes(manifest_bytes(replace(tiny.manifest, codec=codec)))
    done = run(sources=f'sources=[{{release="{tiny.folder}"}}, {{release="{without}"}}]')
    assert done.code == 2, done.text
    assert "latents of codecs must not be mixed" in done.text
    assert not (done.out / "checkpoints").exists()
    assert not (done.out / "run.json").exists()


def test_latents_that_are_not_standardised_are_refused_before_a_folder_is_made(run):
    done = run("read.standardise=false")
    assert done.code == 2
    assert "read.standardise must be true" in done.text
    assert not done.out.exists()


def test_a_run_without_evaluation_says_where_its_model_is(run):
    done = run("held_out.clips=0", "training.max_steps=1")
    assert done.code == 0, done.text
    assert "camera ATE" not in done.text
    assert re.search(r"model: .*model", done.text)


def test_a_release_that_cannot_be_decoded_is_refused_before_the_first_step_with_both_ways_out(run, packed_tiny):
    done = run(release=packed_tiny[0])  # of a codec nobody has
    assert done.code == 2, done.text
    assert "codec_weights" in done.text
    assert "held_out.clips=0" in done.text
    assert not (done.out / "checkpoints").exists()
