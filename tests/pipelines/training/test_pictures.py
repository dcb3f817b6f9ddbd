"""Pictures of a run: decoded as they were encoded, seen and dreamed frames in their places."""

import json
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch

from pipelines.training import pictures as train_pictures
from pipelines.training.config import HeldOutConfig, TrainRunConfig
from pipelines.training.data import held_out_loader
from pipelines.training.pictures import draw_curves, draw_dream
from wsm_data.codecs.dct import DctCodec
from wsm_data.loaders.config import SourceConfig
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.evaluation.decoding import Decoding
from wsm_model.inference.session import SessionConfig
from wsm_model.model import WorldSlamModel
from wsm_model.presets import preset

CPU = torch.device("cpu")
HELD_OUT = HeldOutConfig(flow_steps=2, session=SessionConfig(chunk_size=2))


def test_curves_are_drawn_of_what_was_logged(tmp_path):
    draw_curves(tmp_path)
    assert not (tmp_path / "curves.png").exists()  # a run that has not logged yet
    lines = [{"step": step, "loss": 1 / step, "flow": 0.5, "learning_rate": 1e-3} for step in (1, 2, 3)]
    (tmp_path / "metrics.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    draw_curves(tmp_path)
    assert cv2.imread(str(tmp_path / "curves.png")).std() > 1


@pytest.fixture
def drawn(tiny, tmp_path, monkeypatch):
    """Draws a held-out clip of an untrained model; returns the clip's batch, the sheet, and the picture's path."""

    def draw(variant: Variant = Variant.SLAM, *, is_drawing: bool = True) -> SimpleNamespace:
        torch.manual_seed(0)
        shape = replace(preset("tiny", latent_height=6, latent_width=10, variant=variant), layers=1)
        config = TrainRunConfig(sources=(SourceConfig(release=str(tiny.folder)),), held_out=HELD_OUT)
        with held_out_loader(config, CPU) as loader:
            batch = max(loader, key=lambda one: one.spans[0].length)
        decoding = Decoding(
            codec=DctCodec(), standard=latent_standard(tiny.manifest), depth_range=tiny.manifest.depth_range
        )
        sheets, real = [], train_pictures.draw_dream_sheet
        monkeypatch.setattr(
            train_pictures, "draw_dream_sheet", lambda sheet, path: (sheets.append(sheet), real(sheet, path))
        )
        path = tmp_path / "sheet.png"
        model = WorldSlamModel(shape).eval()
        draw_dream(model, batch, decoding, HELD_OUT, path if is_drawing else None, shift=5.0, title="after step 3")
        return SimpleNamespace(batch=batch, sheet=sheets[0] if sheets else None, path=path)

    return draw


def true_path_m(batch, latents: int) -> np.ndarray:
    """Camera centres of the raw frames of the first latents, slot by slot."""
    slots = batch.poses[0, :latents, :, :3].double().numpy()
    return np.concatenate([slots[0, 3:], *slots[1:]])


def test_the_dream_follows_the_half_that_is_seen(drawn):
    found = drawn()
    assert found.batch.spans[0].length == 5  # two latents are seen, a chunk of two is dreamed
    sheet = found.sheet
    assert sheet.title == f"after step 3: {found.batch.keys[0]}, 5 frames seen, 8 dreamed"
    assert min(sheet.frames) >= 5
    assert max(sheet.frames) <= 12
    np.testing.assert_allclose(sheet.true_path_m, true_path_m(found.batch, 4))
    assert (len(sheet.estimated_path_m), len(sheet.dreamed_path_m)) == (5, 9)
    assert np.array_equal(sheet.estimated_path_m[-1], sheet.dreamed_path_m[0])  # one path, no gap
    assert sheet.estimated_depth_m.shape == sheet.true_depth_m.shape
    assert found.path.stat().st_size > 10_000


def test_without_slam_the_path_that_was_seen_is_given_and_no_depth_is_shown(drawn):
    found = drawn(Variant.IDM)
    assert found.sheet.estimated_depth_m is None
    np.testing.assert_allclose(found.sheet.estimated_path_m, true_path_m(found.batch, 2))
    assert found.path.stat().st_size > 10_000


def test_a_rank_that_only_takes_part_draws_nothing(drawn):
    found = drawn(is_drawing=False)
    assert found.sheet is None
    assert not found.path.exists()
