"""A model on disk, and the data it refuses."""

from dataclasses import replace

import pytest
import torch

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.model_file import ModelCard, load_model, save_model

STANDARD = LatentStandard(
    codec="dct", codec_digest="c0dec", rgb_mean=(0.0,), rgb_std=(1.0,), depth_mean=(0.5,), depth_std=(2.0,)
)


@pytest.fixture
def saved(make_model, tmp_path):
    """A model and the folder it was saved in."""
    model = make_model()
    card = ModelCard(config=model.config, standard=STANDARD, releases=("abc",), steps=7)
    save_model(tmp_path / "model", model, card)
    return model, tmp_path / "model"


def test_a_model_comes_back_with_its_weights_and_its_card(saved):
    model, folder = saved
    loaded, card = load_model(folder, STANDARD)
    assert (card.config, card.steps, card.releases, card.standard) == (model.config, 7, ("abc",), STANDARD)
    assert not loaded.training
    for (name, wanted), (same, found) in zip(model.named_parameters(), loaded.named_parameters(), strict=True):
        assert name == same
        assert torch.equal(found, wanted)


@pytest.mark.parametrize(
    ("changes", "named"), [({"codec_digest": "other"}, "codec_digest"), ({"depth_std": (3.0,)}, "depth_std")]
)
def test_latents_of_another_codec_or_other_statistics_are_refused(saved, changes, named):
    with pytest.raises(ConfigError, match=f"differ in {named}"):
        load_model(saved[1], replace(STANDARD, **changes))


def test_changed_weights_are_refused(saved):
    path = saved[1] / "model.safetensors"
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    with pytest.raises(IntegrityError, match="must have sha256"):
        load_model(saved[1])


def test_a_folder_without_a_card_holds_no_model(saved):
    (saved[1] / "model.json").unlink()
    with pytest.raises(ConfigError, match="there is no model in"):
        load_model(saved[1])


def test_a_card_that_says_something_else_is_refused(saved):
    path = saved[1] / "model.json"
    path.write_text(path.read_text().replace('"layers": 2', '"layrs": 2'))
    with pytest.raises(IntegrityError, match=r"unknown key config\.layrs"):
        load_model(saved[1])
