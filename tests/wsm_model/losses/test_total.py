"""The objective against a loop over sequences, what padding may hold, and parts of a step."""

from dataclasses import replace

import pytest
import torch

from wsm_data.schema.sequence import SequenceSpan
from wsm_model.inputs import ModelInputs, ModelOutputs
from wsm_model.losses.pose import pose_losses
from wsm_model.losses.total import LossConfig, counted_frames, loss_counts, pretraining_loss

SPANS = (
    SequenceSpan(row=0, start=0, length=6, chunk_size=2),
    SequenceSpan(row=1, start=0, length=3, chunk_size=1),
    SequenceSpan(row=1, start=3, length=1, chunk_size=4),
    SequenceSpan(row=2, start=1, length=4, chunk_size=3),
)
FRAMES = 7
PAPER = LossConfig()
ROUNDING = 1e-5  # relative, of float32 over some thousand summands


@pytest.fixture
def batch(make_inputs, make_poses) -> tuple[ModelInputs, ModelOutputs, torch.Tensor]:
    """Four sequences with padding before, between and after them; predictions and noise are random."""
    inputs = make_inputs(SPANS, frames=FRAMES)
    generator = torch.Generator().manual_seed(2)
    velocity, depth, noise = torch.randn(3, *inputs.rgb.shape, generator=generator).unbind(0)
    poses = make_poses(*inputs.poses.shape[:-1], generator=generator)
    return inputs, ModelOutputs(velocity=velocity, depth=depth, poses=poses), noise


def bell(flow_time: float, shift: float) -> float:
    """Weight of a flow time as the specification says it, section 7, with plain numbers."""
    grid = torch.arange(1, 1001).double() / 1000
    shifted = shift * grid / (1 + (shift - 1) * grid)
    heights = torch.exp(-2 * (shifted - 0.5) ** 2)
    lowest = heights.min()
    height = torch.exp(torch.tensor(-2 * (flow_time - 0.5) ** 2, dtype=torch.float64))
    return float((height - lowest) / (heights - lowest).mean())


def by_loops(batch: tuple[ModelInputs, ModelOutputs, torch.Tensor], config: LossConfig) -> dict[str, float]:
    """The parts, sequence by sequence and latent by latent."""
    inputs, outputs, noise = batch
    flow, depth, absolute, relative = [], [], [], []
    for span in inputs.spans:
        places = [(span.row, span.start + latent) for latent in range(span.length)]
        for place in places:
            depth.append(float(((outputs.depth[place] - inputs.depth[place]) ** 2).mean()))
        for place in places[1:]:  # the anchor is not dreamed
            error = outputs.velocity[place] - (noise[place] - inputs.rgb[place])
            flow.append(bell(float(inputs.flow_time[place]), config.flow_shift) * float((error**2).mean()))
        frames = [(*places[0], 3)] + [(*place, slot) for place in places[1:] for slot in range(4)]
        predicted, target = (torch.stack([poses[frame] for frame in frames]) for poses in (outputs.poses, inputs.poses))
        of_path = pose_losses(predicted, target, config.pose_delta)  # has tests of its own
        absolute.append(float(of_path.absolute))
        relative.append(float(of_path.relative))
    lists = {"flow": flow, "depth": depth, "pose_absolute": absolute, "pose_relative": relative}
    return {name: sum(values) / len(values) for name, values in lists.items()}


@pytest.mark.parametrize("config", [PAPER, LossConfig(depth=3.0, pose=0.2, pose_delta=1.5, flow_shift=2.0)])
def test_parts_and_total_equal_a_loop_over_sequences(batch, config):
    report, wanted = pretraining_loss(*batch, config), by_loops(batch, config)
    assert {name: float(value) for name, value in report.parts.items()} == pytest.approx(wanted, rel=ROUNDING)
    poses = wanted["pose_absolute"] + wanted["pose_relative"]
    assert float(report.total) == pytest.approx(wanted["flow"] + config.depth * wanted["depth"] + config.pose * poses)


def test_the_weights_are_those_of_the_paper():
    """Table "Pretraining hyperparameters": lambda_d 1, lambda_p 0.5, delta 0.1, gamma 5."""
    assert LossConfig(depth=1.0, pose=0.5, pose_delta=0.1, flow_shift=5.0) == PAPER


def padding_filled(batch, value: float):
    """The same batch with a value in every frame of padding."""
    inputs, outputs, noise = batch
    padding = inputs.table.sequence < 0

    def fill(tensor: torch.Tensor) -> torch.Tensor:
        filled = tensor.clone()
        filled[padding] = value
        return filled

    names = ("rgb", "depth", "poses", "noisy_rgb", "flow_time")
    filled_inputs = replace(inputs, **{name: fill(getattr(inputs, name)) for name in names})
    filled_outputs = {name: fill(getattr(outputs, name)) for name in ("velocity", "depth", "poses")}
    return filled_inputs, ModelOutputs(**filled_outputs), fill(noise)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_whatever_padding_holds_counts_nothing(batch, value):
    wanted, found = pretraining_loss(*batch, PAPER), pretraining_loss(*padding_filled(batch, value), PAPER)
    assert torch.equal(found.total, wanted.total)
    for name, part in wanted.parts.items():
        assert torch.equal(found.parts[name], part)


def test_gradients_reach_every_counted_frame_and_no_padding(batch):
    inputs, outputs, _ = batch
    for prediction in (outputs.velocity, outputs.depth, outputs.poses):
        prediction.requires_grad_()
    pretraining_loss(*batch, PAPER).total.backward()
    real, dreamed = counted_frames(inputs.table, torch.device("cpu"))
    for prediction, counted in ((outputs.velocity, dreamed), (outputs.depth, real), (outputs.poses, real)):
        assert torch.equal(prediction.grad.flatten(2).abs().amax(2) > 0, counted)


def part_of(batch, rows: list[int]):
    """Some rows of a batch as a batch of their own."""
    inputs, outputs, noise = batch
    spans = tuple(replace(span, row=rows.index(span.row)) for span in inputs.spans if span.row in rows)
    names = ("rgb", "depth", "poses", "noisy_rgb", "flow_time")
    own = replace(inputs, spans=spans, **{name: getattr(inputs, name)[rows] for name in names})
    names = ("velocity", "depth", "poses")
    return own, ModelOutputs(**{name: getattr(outputs, name)[rows] for name in names}), noise[rows]


@pytest.mark.parametrize("parts", [([0], [1], [2]), ([2, 0], [1])])
def test_parts_of_a_step_with_the_counts_of_the_step_add_up_to_its_losses(batch, parts):
    whole, counts = pretraining_loss(*batch, PAPER), loss_counts(SPANS)
    reports = [pretraining_loss(*part_of(batch, rows), PAPER, counts) for rows in parts]
    torch.testing.assert_close(sum(report.total for report in reports), whole.total)
    for name, value in whole.parts.items():
        torch.testing.assert_close(sum(report.parts[name] for report in reports), value)


def test_counts_are_dreamed_latents_latents_and_sequences():
    counts = loss_counts(SPANS)
    assert (counts.dreamed, counts.latents, counts.sequences) == (10, 14, 4)


def test_without_slam_there_is_no_depth_part(batch):
    inputs, outputs, noise = batch
    report = pretraining_loss(inputs, replace(outputs, depth=None), noise, LossConfig(depth=1e6))
    assert set(report.parts) == {"flow", "pose_absolute", "pose_relative"}
    wanted = pretraining_loss(inputs, outputs, noise, LossConfig(depth=0.0))
    torch.testing.assert_close(report.total, wanted.total)


def test_a_batch_of_anchors_alone_has_losses(batch, make_inputs):
    inputs = make_inputs([SequenceSpan(row=0, start=0, length=1, chunk_size=4)])
    _, outputs, noise = part_of(batch, [0])
    first = ModelOutputs(velocity=outputs.velocity[:, :1], depth=outputs.depth[:, :1], poses=outputs.poses[:, :1])
    report = pretraining_loss(inputs, first, noise[:, :1], PAPER)
    assert float(report.parts["flow"]) == float(report.parts["pose_relative"]) == 0.0
    assert float(report.parts["depth"]) > 0
    assert torch.isfinite(report.total)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"flow_shift": 0.0}, "flow_shift"),
        ({"pose_delta": 0.0}, "pose_delta"),
        ({"depth": -1.0}, "depth"),
        ({"pose": float("nan")}, "pose"),
    ],
)
def test_weights_that_make_no_loss_are_refused(changes, named):
    with pytest.raises(ValueError, match=f"^{named} must be"):
        LossConfig(**changes)
