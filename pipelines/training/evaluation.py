"""What a trained model is worth on clips it never saw: a table for people, numbers for programs."""

import dataclasses
import json
import logging
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from tqdm import tqdm

from pipelines.training.config import HeldOutConfig
from wsm_data.files.atomic import write_text
from wsm_data.files.typed_toml import build_config
from wsm_data.loaders.batches.batch import Batch
from wsm_data.loaders.loader import ClipLoader
from wsm_data.view.drawing.text_table import aligned
from wsm_model.evaluation.baselines import fit_baselines
from wsm_model.evaluation.decoding import Decoding
from wsm_model.evaluation.flow import FlowErrors, flow_matching_errors
from wsm_model.evaluation.held_out import ClipErrors, HeldOutSettings, clip_errors
from wsm_model.evaluation.summary import summarise
from wsm_model.inference.sampler import flow_schedule
from wsm_model.model import WorldSlamModel
from wsm_model.ranks import gather_text, rank_and_world_size

_LOG = logging.getLogger(__name__)


def evaluate(
    model: WorldSlamModel,
    loader: ClipLoader,
    config: HeldOutConfig,
    path: Path,
    *,
    decoding: Decoding,
    shift: float,
    quiet: bool,
) -> str:
    """Measure a model on held-out clips, write the numbers to `path`, and return a table of their means.

    Ranks share the clips; the first writes, and the others return an empty table. Without SLAM a model estimates no
    state of what it sees: there are its dreams and the flow-matching loss alone.

    Args:
        model: in evaluation mode.
        loader: of held-out clips, one by one.
        config: how many, and how states are estimated.
        path: JSON file to write: means by name, then each clip, and the flow-matching losses.
        decoding: of the release.
        shift: gamma of the flow time.
        quiet: no progress bar.
    """
    clips = min(config.clips, loader.steps)
    if clips < config.clips:
        _LOG.warning("%d held-out clips were asked for, the split %s has %d", config.clips, config.split, clips)
    batches = list(islice(loader, clips))
    errors = held_out_errors(model, batches, config, decoding=decoding, shift=shift, quiet=quiet)
    rank, _ = rank_and_world_size()
    if rank:
        return ""
    means, flow = summarise(errors), flow_matching_errors(model, batches, seed=0, shift=shift)
    record = {**means, "flow": dataclasses.asdict(flow), "clips": [dataclasses.asdict(one) for one in errors]}
    write_text(path, json.dumps(record, indent=1) + "\n")
    return evaluation_table(means, flow, len(batches))


def held_out_errors(
    model: WorldSlamModel,
    batches: Sequence[Batch],
    config: HeldOutConfig,
    *,
    decoding: Decoding,
    shift: float,
    quiet: bool,
) -> list[ClipErrors]:
    """Errors of a model on clips, beside guesses that are fitted to those clips; arguments as in `evaluate`.

    Each rank takes every n-th clip, with a whole model of its own; all return the errors of all.
    """
    settings = HeldOutSettings(
        session=config.session,
        schedule=flow_schedule(config.flow_steps, shift),
        decoding=decoding,
        baselines=fit_baselines(batches, decoding, config.session.chunk_size),
    )
    rank, world_size = rank_and_world_size()
    found: list[tuple[int, ClipErrors]] = []
    for number in tqdm(range(rank, len(batches), world_size), unit="clip", desc="evaluate", disable=quiet):
        found += [(number, one) for one in clip_errors(model, batches[number], settings)]
    return found_by_all(found)


def found_by_all(found: Sequence[tuple[int, ClipErrors]]) -> list[ClipErrors]:
    """Errors that the ranks found, each with the number of its batch, in the order of those numbers."""
    own = json.dumps([[number, dataclasses.asdict(one)] for number, one in found])
    everyone = [pair for text in gather_text(own) for pair in json.loads(text)]
    return [build_config(ClipErrors, record) for _, record in sorted(everyone, key=lambda pair: int(pair[0]))]


def curve_values(means: Mapping[str, object]) -> dict[str, float]:
    """Means as numbers of a curve: those of +1, +2, ... latents each by a name of their own, unknown ones left out."""
    found: dict[str, float] = {}
    for name, value in means.items():
        parts = {f"{name}_{ahead + 1}": one for ahead, one in enumerate(value)} if isinstance(value, list) else {}
        known = {key: one for key, one in (parts or {name: value}).items() if isinstance(one, float)}
        found |= {f"held_out_{key}": one for key, one in known.items()}
    return found


def evaluation_table(means: Mapping[str, Any], flow: FlowErrors, clips: int) -> str:
    """Means over the clips beside those of what knows nothing; no row of what no clip has."""
    rows = [
        *(_state_rows(means) if "depth_mse" in means else []),
        *(_dream_rows(means) if "dream_psnr_db" in means else []),
        ["flow matching", f"{flow.model:.3f}", f"copy {flow.copy:.3f}, unconditional {flow.unconditional:.3f}"],
    ]
    return aligned([[f"mean over {clips} held-out clips", "model", "beside it"], *rows])


def _state_rows(means: Mapping[str, Any]) -> list[list[str]]:
    return [
        [
            "camera ATE, not aligned (m)",
            _number(means["ate_rmse_unaligned_m"]),
            f"zero motion {_number(means['ate_rmse_zero_motion_m'])}, "
            f"constant velocity {_number(means['ate_rmse_constant_velocity_m'])}",
        ],
        ["camera ATE, Sim(3) (m)", _number(means["ate_rmse_sim3_m"]), ""],
        *(
            [label, _number(means[name]), f"constant map {_number(means[f'{name}_constant_map'])}"]
            for label, name in (
                ("depth, AbsRel", "depth_abs_rel"),
                ("depth, delta_1", "depth_delta1"),
                ("depth, log RMSE", "depth_log_rmse"),
            )
        ),
        [
            "depth latents, squared error",
            _number(means["depth_mse"]),
            f"training mean {_number(means['mean_depth_mse'])}",
        ],
    ]


def _dream_rows(means: Mapping[str, Any]) -> list[list[str]]:
    return [
        [
            f"dream at +{number + 1}, {label}",
            _number(means[f"dream_{name}"][number]),
            f"copy {_number(means[f'copy_{name}'][number])}, "
            f"shrunk copy {_number(means[f'shrunk_copy_{name}'][number])}",
        ]
        for label, name in (("PSNR (dB)", "psnr_db"), ("SSIM", "ssim"))
        for number in range(len(means[f"dream_{name}"]))
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
