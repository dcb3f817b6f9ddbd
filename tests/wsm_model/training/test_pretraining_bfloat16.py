"""Training in bfloat16: what is kept is float32, and the run is that of float32 to rounding."""

from dataclasses import replace

import pytest
import torch

from wsm_model.precision import Precision
from wsm_model.training.checkpoint import checkpoints

pytestmark = pytest.mark.filterwarnings("ignore:Mismatch dtype between input and weight")


def test_losses_follow_those_of_float32_and_weights_stay_float32(run, settings, undisturbed, tmp_path):
    """bfloat16 keeps 8 bits: each of the ten roundings on the way to a loss is below 0.4 %, and they average out."""
    wanted = undisturbed.lines
    model, found = run(tmp_path, replace(settings, precision=Precision.BFLOAT16))
    for exact, near in zip(wanted, found, strict=True):
        for name in ("loss", "flow", "depth", "pose_absolute", "pose_relative"):
            assert near[name] == pytest.approx(exact[name], rel=0.02), name
    assert found[0]["loss"] != wanted[0]["loss"]  # bfloat16 was at work
    assert {parameter.dtype for parameter in model.parameters()} == {torch.float32}


def test_a_run_in_bfloat16_that_is_killed_and_resumed_ends_in_the_same_bits(run, settings, tmp_path):
    settings = replace(settings, precision=Precision.BFLOAT16)
    undisturbed, _ = run(tmp_path / "a", settings)
    run(tmp_path / "b", settings, kill_after=3)
    assert [path.name for path in checkpoints(tmp_path / "b")] == ["step-000002"]
    resumed, _ = run(tmp_path / "b", settings)
    for wanted, found in zip(undisturbed.parameters(), resumed.parameters(), strict=True):
        assert torch.equal(found, wanted)
