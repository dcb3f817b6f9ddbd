"""What a trained model is worth on clips it never saw: a table for people, numbers for programs."""

import dataclasses
import json
import logging
from itertools import islice
from pathlib import Path

from tqdm import tqdm

from pipelines.training.config import HeldOutConfig
from wsm_data.files.atomic import write_text
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.loader import ClipLoader
from wsm_data.view.drawing.text_table import aligned
from wsm_model.config import Variant
from wsm_model.evaluation.held_out import ClipErrors, FlowErrors, clip_errors, flow_matching_errors, mean_of
from wsm_model.model import WorldSlamModel

_LOG = logging.getLogger(__name__)


def evaluate(
    model: WorldSlamModel, loader: ClipLoader, config: HeldOutConfig, path: Path, *, shift: float, quiet: bool
) -> str:
    """Measure a model on held-out clips, write the numbers to `path`, and return a table of their means.

    Without SLAM a model estimates no state of what it sees: there is the flow-matching loss alone.

    Args:
        model: in evaluation mode.
        loader: of held-out clips, one by one.
        config: how many, and how states are estimated.
        path: JSON file to write.
        shift: gamma of the flow time.
        quiet: no progress bar.
    """
    clips = min(config.clips, loader.steps)
    if clips < config.clips:
        _LOG.warning("%d held-out clips were asked for, the split %s has %d", config.clips, config.split, clips)
    estimates = model.config.variant is Variant.SLAM
    batches: list[Batch] = []
    errors: list[ClipErrors] = []
    for batch in tqdm(islice(loader, clips), total=clips, unit="clip", desc="evaluate", disable=quiet):
        batches.append(batch)
        errors += clip_errors(model, batch, config.session) if estimates else []
    flow = flow_matching_errors(model, batches, seed=0, shift=shift)
    record = {"clips": [dataclasses.asdict(one) for one in errors], "flow": dataclasses.asdict(flow)}
    write_text(path, json.dumps(record, indent=1) + "\n")
    return evaluation_table(errors, flow, len(batches))


def evaluation_table(errors: list[ClipErrors], flow: FlowErrors, clips: int) -> str:
    """Means over the clips beside those of what knows nothing; no states where there are no errors of any."""
    rows = [["flow matching", f"{flow.model:.3f}", f"copy {flow.copy:.3f}, unconditional {flow.unconditional:.3f}"]]
    if errors:
        rows = [*_state_rows(errors), *rows]
    return aligned([[f"mean over {clips} held-out clips", "model", "beside it"], *rows])


def _state_rows(errors: list[ClipErrors]) -> list[list[str]]:
    ate, still, steady = (
        mean_of(errors, name)
        for name in ("ate_rmse_unaligned_m", "ate_rmse_zero_motion_m", "ate_rmse_constant_velocity_m")
    )
    depth, mean_depth = mean_of(errors, "depth_mse"), mean_of(errors, "mean_depth_mse")
    return [
        ["camera ATE, not aligned (m)", f"{ate:.3f}", f"zero motion {still:.3f}, constant velocity {steady:.3f}"],
        ["depth latents, squared error", f"{depth:.3f}", f"training mean {mean_depth:.3f}"],
    ]
