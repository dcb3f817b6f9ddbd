"""wsm model export and push."""

import json

import pytest
import torch
from typer.testing import CliRunner

from pipelines.cli import app
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import ModelCard, load_model, save_model
from wsm_model.presets import preset

STANDARD = LatentStandard(codec="dct", codec_digest="1", rgb_mean=(), rgb_std=(), depth_mean=(), depth_std=())


def wsm(*words):
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tiny model with random weights."""
    torch.manual_seed(0)
    model, folder = WorldSlamModel(preset("tiny")), tmp_path_factory.mktemp("tiny") / "model"
    save_model(folder, model, ModelCard(config=model.config, standard=STANDARD, releases=("r",), steps=7))
    return folder


def test_in_bfloat16_a_model_takes_little_over_half_the_bytes_and_matrices_are_rounded_once(folder, tmp_path):
    code, text = wsm("model", "export", folder, "--out", tmp_path / "half")
    assert code == 0, text
    sizes = [(one / "model.safetensors").stat().st_size for one in (folder, tmp_path / "half")]
    assert 0.5 < sizes[1] / sizes[0] < 0.65
    (found, card), (wanted, _) = load_model(tmp_path / "half"), load_model(folder)
    assert (card.steps, card.releases) == (7, ("r",))
    own = dict(wanted.named_parameters())
    for name, parameter in found.named_parameters():
        rounded = own[name].bfloat16().float()
        assert torch.equal(parameter, own[name]) or torch.equal(parameter, rounded), name


def test_the_rgb_expert_is_written_for_diffusers(folder, tmp_path):
    code, text = wsm("model", "export", folder, "--out", tmp_path / "wan", "--layout", "diffusers")
    assert code == 0, text
    config = json.loads((tmp_path / "wan" / "config.json").read_text())
    assert (config["_class_name"], config["num_layers"], config["text_dim"]) == ("WanTransformer3DModel", 6, 63)


def test_a_model_is_pushed_into_a_folder(folder, tmp_path):
    code, text = wsm("model", "push", folder, tmp_path / "shared")
    assert code == 0, text
    assert load_model(tmp_path / "shared")[1].steps == 7


def test_a_folder_without_a_model_and_the_model_itself_as_output_are_refused(folder, tmp_path):
    for words, message in (
        (("export", tmp_path, "--out", tmp_path / "out"), "there is no model in"),
        (("export", folder, "--out", folder), "must be another folder"),
        (("push", tmp_path, tmp_path / "out"), "there is no model in"),
    ):
        code, text = wsm("model", *words)
        assert code == 2, text
        assert message in text
