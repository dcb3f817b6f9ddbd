"""Models in folders and on a hub; nothing is sent anywhere."""

import json

import pytest
import torch
from huggingface_hub.errors import OfflineModeIsEnabled

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model import hub
from wsm_model.model_file import ModelCard, save_model

STANDARD = LatentStandard(codec="dct", codec_digest="1", rgb_mean=(), rgb_std=(), depth_mean=(), depth_std=())


@pytest.fixture
def saved(make_model, tmp_path):
    model = make_model(layers=1)
    save_model(tmp_path / "model", model, ModelCard(config=model.config, standard=STANDARD, releases=(), steps=3))
    return model, tmp_path / "model"


def test_a_model_is_put_into_a_folder_and_read_from_there(saved, tmp_path):
    model, folder = saved
    place = hub.push_to_hub(folder, str(tmp_path / "there"))
    found, card = hub.from_pretrained(place)
    assert card.steps == 3
    assert all(torch.equal(a, b) for a, b in zip(found.parameters(), model.parameters(), strict=True))


def test_a_repository_gets_weights_and_card_alone_and_gives_them_back(saved, monkeypatch):
    _, folder = saved
    (folder / "notes.txt").write_text("not for others")
    sent = []

    class Api:
        def create_repo(self, place, **settings):
            sent.append((place, settings))

        def upload_folder(self, **given):
            sent.append(given)
            return f"hub/{given['repo_id']}"

    def fetched(place, **given):
        sent.append((place, given))
        return str(folder)

    monkeypatch.setattr(hub, "HfApi", Api)
    monkeypatch.setattr(hub, "snapshot_download", fetched)
    assert hub.push_to_hub(folder, "owner/name", private=True) == "hub/owner/name"
    assert sent[0] == ("owner/name", {"private": True, "exist_ok": True})
    assert sent[1]["allow_patterns"] == ["model.safetensors", "model.json"]
    assert hub.from_pretrained("owner/name", revision="v1")[1].steps == 3
    assert sent[2] == ("owner/name", {"revision": "v1", "allow_patterns": ["model.safetensors", "model.json"]})


def test_without_a_network_it_is_said_that_a_folder_will_do(saved, monkeypatch):
    def refuse(*_given, **_settings):
        raise OfflineModeIsEnabled("offline")

    monkeypatch.setattr(hub.HfApi, "create_repo", refuse)
    monkeypatch.setattr(hub, "snapshot_download", refuse)
    with pytest.raises(ConfigError, match="or give a folder"):
        hub.push_to_hub(saved[1], "owner/name")
    with pytest.raises(ConfigError, match="must be a folder of a model or a repository"):
        hub.from_pretrained("owner/name")


def test_a_damaged_model_is_not_sent(saved, tmp_path):
    card = json.loads((saved[1] / "model.json").read_text())
    (saved[1] / "model.json").write_text(json.dumps(card | {"weights_sha256": "0"}))
    with pytest.raises(IntegrityError, match="must have sha256 0"):
        hub.push_to_hub(saved[1], str(tmp_path / "there"))
    assert not (tmp_path / "there").exists()
