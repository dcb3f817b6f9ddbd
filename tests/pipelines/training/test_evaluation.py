"""What an evaluation writes for programs, and says to people."""

import json
import logging
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from pipelines.training.config import HeldOutConfig, TrainRunConfig
from pipelines.training.data import held_out_loader
from pipelines.training.evaluation import curve_values, evaluate, evaluation_table
from wsm_data.codecs.dct import DctCodec
from wsm_data.loaders.config import SourceConfig
from wsm_data.shards.latent_standard import latent_standard
from wsm_model.config import Variant
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.flow import FlowErrors
from wsm_model.inference.session import SessionConfig
from wsm_model.model import WorldSlamModel
from wsm_model.presets import preset

CPU = torch.device("cpu")
HELD_OUT = HeldOutConfig(clips=2, session=SessionConfig(chunk_size=2))
FLOW = FlowErrors(model=1.25, copy=2.5, unconditional=1.5)


@pytest.fixture
def evaluated(tiny, tmp_path) -> Callable[..., SimpleNamespace]:
    """Evaluates an untrained model on the two test clips of the tiny release."""

    def run(name: str = "evaluation.json", variant: Variant = Variant.SLAM, **changes: object) -> SimpleNamespace:
        torch.manual_seed(0)
        shape = replace(preset("tiny", latent_height=6, latent_width=10, variant=variant), layers=1)
        held_out = replace(HELD_OUT, **changes)
        config = TrainRunConfig(sources=(SourceConfig(release=str(tiny.folder)),), held_out=held_out)
        path = tmp_path / name
        with held_out_loader(config, CPU) as loader:
            decoding = Decoding(
                codec=DctCodec(), standard=latent_standard(tiny.manifest), depth_range=tiny.manifest.depth_range
            )
            model = WorldSlamModel(shape).eval()
            table = evaluate(model, loader, held_out, path, decoding=decoding, shift=5.0, quiet=True)
        return SimpleNamespace(table=table, record=json.loads(path.read_text()), path=path)

    return run


def test_the_file_holds_every_clip_and_the_table_their_means(evaluated, tiny):
    found = evaluated()
    clips = found.record["clips"]
    assert sorted(clip["key"] for clip in clips) == sorted(clip.meta.key for clip in tiny.clips[-2:])
    for name in ("ate_rmse_unaligned_m", "ate_rmse_constant_velocity_m", "depth_mse"):
        assert found.record[name] == pytest.approx(sum(clip["states"][name] for clip in clips) / 2)
    assert found.record["depth_abs_rel"] == pytest.approx(sum(one["states"]["depth"]["abs_rel"] for one in clips) / 2)
    assert f"camera ATE, not aligned (m)   {found.record['ate_rmse_unaligned_m']:.3f}" in found.table
    assert f"constant map {found.record['depth_abs_rel_constant_map']:.3f}" in found.table
    for name in ("dream_psnr_db", "copy_psnr_db", "shrunk_copy_psnr_db"):
        assert len(found.record[name]) == HELD_OUT.session.chunk_size


def test_an_untrained_camera_stays_and_has_the_error_of_zero_motion(evaluated):
    for clip in evaluated().record["clips"]:
        states = clip["states"]
        assert states["ate_rmse_unaligned_m"] == pytest.approx(states["ate_rmse_zero_motion_m"], rel=1e-6)


def test_the_same_model_and_clips_give_the_same_bytes(evaluated):
    assert evaluated("a").path.read_bytes() == evaluated("b").path.read_bytes()


def test_no_more_clips_are_evaluated_than_asked_for(evaluated, caplog):
    found = evaluated(clips=1)
    assert len(found.record["clips"]) == 1
    assert "mean over 1 held-out clips" in found.table
    assert not caplog.text


def test_fewer_clips_than_asked_for_are_announced_and_counted(evaluated, caplog):
    with caplog.at_level(logging.WARNING):
        found = evaluated(clips=16)
    assert "16 held-out clips were asked for, the split test has 2" in caplog.text
    assert "mean over 2 held-out clips" in found.table


def test_without_slam_there_are_dreams_and_the_flow_alone(evaluated):
    found = evaluated(variant=Variant.IDM)
    assert [clip["states"] for clip in found.record["clips"]] == [None, None]
    assert set(found.record["flow"]) == {"model", "copy", "unconditional"}
    assert "depth_abs_rel" not in found.record
    assert [line.split()[0] for line in found.table.splitlines()] == ["mean", *["dream"] * 4, "flow"]
    assert "mean over 2 held-out clips" in found.table


def test_the_table_shows_what_it_was_given():
    means = {
        "ate_rmse_unaligned_m": 0.2,
        "ate_rmse_sim3_m": None,
        "ate_rmse_zero_motion_m": 1.0,
        "ate_rmse_constant_velocity_m": 2.0,
        "depth_mse": 0.5,
        "mean_depth_mse": 1.0,
        **{f"depth_{name}": 0.25 for name in ("abs_rel", "delta1", "log_rmse")},
        **{f"depth_{name}_constant_map": 0.75 for name in ("abs_rel", "delta1", "log_rmse")},
        **{f"{name}_psnr_db": [20.0] for name in ("dream", "copy", "shrunk_copy")},
        **{f"{name}_ssim": [0.5] for name in ("dream", "copy", "shrunk_copy")},
    }
    assert [" ".join(line.split()) for line in evaluation_table(means, FLOW, 2).splitlines()] == [
        "mean over 2 held-out clips model beside it",
        "camera ATE, not aligned (m) 0.200 zero motion 1.000, constant velocity 2.000",
        "camera ATE, Sim(3) (m) -",
        "depth, AbsRel 0.250 constant map 0.750",
        "depth, delta_1 0.250 constant map 0.750",
        "depth, log RMSE 0.250 constant map 0.750",
        "depth latents, squared error 0.500 training mean 1.000",
        "dream at +1, PSNR (dB) 20.000 copy 20.000, shrunk copy 20.000",
        "dream at +1, SSIM 0.500 copy 0.500, shrunk copy 0.500",
        "flow matching 1.250 copy 2.500, unconditional 1.500",
    ]


def test_a_curve_has_a_number_for_each_latent_ahead_and_none_for_what_is_unknown():
    means = {"depth_abs_rel": 0.5, "ate_rmse_sim3_m": None, "dream_psnr_db": [20.0, None]}
    assert curve_values(means) == {"held_out_depth_abs_rel": 0.5, "held_out_dream_psnr_db_1": 20.0}
