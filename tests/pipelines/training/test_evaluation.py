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
from pipelines.training.evaluation import evaluate, evaluation_table
from wsm_data.loaders.config import SourceConfig
from wsm_model.config import Variant
from wsm_model.evaluation.held_out import ClipErrors, FlowErrors
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
            table = evaluate(WorldSlamModel(shape).eval(), loader, held_out, path, shift=5.0, quiet=True)
        return SimpleNamespace(table=table, record=json.loads(path.read_text()), path=path)

    return run


def test_the_file_holds_every_clip_and_the_table_their_means(evaluated, tiny):
    found = evaluated()
    clips = found.record["clips"]
    assert sorted(clip["key"] for clip in clips) == sorted(clip.meta.key for clip in tiny.clips[-2:])
    means = {name: sum(clip[name] for clip in clips) / 2 for name in clips[0] if name != "key"}
    flow = found.record["flow"]
    assert [" ".join(line.split()) for line in found.table.splitlines()] == [
        "mean over 2 held-out clips model beside it",
        f"camera ATE, not aligned (m) {means['ate_rmse_unaligned_m']:.3f} "
        f"zero motion {means['ate_rmse_zero_motion_m']:.3f}, "
        f"constant velocity {means['ate_rmse_constant_velocity_m']:.3f}",
        f"depth latents, squared error {means['depth_mse']:.3f} training mean {means['mean_depth_mse']:.3f}",
        f"flow matching {flow['model']:.3f} copy {flow['copy']:.3f}, unconditional {flow['unconditional']:.3f}",
    ]


def test_an_untrained_camera_stays_and_has_the_error_of_zero_motion(evaluated):
    for clip in evaluated().record["clips"]:
        assert clip["ate_rmse_unaligned_m"] == pytest.approx(clip["ate_rmse_zero_motion_m"], rel=1e-6)


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


def test_without_slam_there_is_the_flow_alone(evaluated):
    found = evaluated(variant=Variant.IDM)
    assert found.record["clips"] == []
    assert set(found.record["flow"]) == {"model", "copy", "unconditional"}
    assert [line.split()[0] for line in found.table.splitlines()] == ["mean", "flow"]
    assert "mean over 2 held-out clips" in found.table


def test_the_table_shows_what_it_was_given():
    error = ClipErrors(
        key="a",
        ate_rmse_unaligned_m=0.1,
        ate_rmse_zero_motion_m=1.0,
        ate_rmse_constant_velocity_m=2.0,
        depth_mse=0.25,
        mean_depth_mse=1.0,
    )
    table = evaluation_table([error, replace(error, ate_rmse_unaligned_m=0.3, depth_mse=0.75)], FLOW, 2)
    assert table == (
        "mean over 2 held-out clips    model  beside it\n"
        "camera ATE, not aligned (m)   0.200  zero motion 1.000, constant velocity 2.000\n"
        "depth latents, squared error  0.500  training mean 1.000\n"
        "flow matching                 1.250  copy 2.500, unconditional 1.500"
    )
