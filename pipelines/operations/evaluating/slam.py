"""`wsm eval slam`: camera poses and points of a model, or of any other system, against a release's held-out clips."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import typer
from tqdm import tqdm

from pipelines.evaluating.slam_errors import METRICS, SequenceErrors, compared_centres, sequence_errors, summarise
from pipelines.evaluating.slam_sequence import (
    Reconstruction,
    read_reconstruction,
    shown_frames,
    true_reconstruction,
    write_reconstruction,
)
from wsm_data.access.release import Release, open_release
from wsm_data.clips.decoded import DecodedVideo
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import write_text
from wsm_data.files.tables import write_table
from wsm_data.schema.clip import Clip
from wsm_data.view.drawing.text_table import aligned
from wsm_data.view.navigation.estimated_paths import draw_estimated_paths


@dataclass(frozen=True, kw_only=True)
class SlamRequest:
    """What is evaluated.

    Attributes:
        model: folder of a model; or
        estimates: folder with a folder for each sequence, named by the clip's key.
        split: split of the clips; empty: all.
        limit: at most this many clips; 0: all.
        weights: folder of the codec's weights, where it has any.
        seed: of the intervals.
    """

    model: Path | None
    estimates: Path | None
    split: str
    limit: int
    weights: str
    seed: int


def eval_slam(location: str, request: SlamRequest, out: Path, quiet: bool) -> None:
    """Evaluate, write summary.json, sequences.parquet, every sequence's TUM, PLY and PNG, and print the means.

    Raises:
        ConfigError: not one of model and estimates is named, or there is no such split.
        DataError: a sequence has no estimate, or an unreadable one.
    """
    release = open_release(location)
    keys = sorted(release.keys(split=request.split))
    estimate = _estimator(release, request)
    errors = []
    for key in tqdm(keys[: request.limit] if request.limit else keys, unit="sequence", disable=quiet):
        clip = release.read_clip(key)
        decoded = release.decode(clip, frames=shown_frames(clip), weights=request.weights)
        estimated, true = estimate(clip, decoded), true_reconstruction(clip, decoded)
        for name, one in (("estimated", estimated), ("true", true)):
            write_reconstruction(out / "sequences" / key / name, one)
        draw_estimated_paths(out / "sequences" / key / "paths.png", key, compared_centres(estimated, true))
        errors.append(sequence_errors(key, clip.meta.id.physical_scene, estimated, true))
    write_table(out / "sequences.parquet", sequence_table(errors))
    summary = {
        "release": release.digest,
        "split": request.split,
        "system": str(request.model or request.estimates),
        "inputs": ["rgb"] if request.model else None,  # another system may have been given depth
        **summarise(errors, request.seed),
    }
    write_text(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    typer.echo(summary_table(summary))
    typer.echo(f"summary: {out / 'summary.json'}")


def sequence_table(errors: Sequence[SequenceErrors]) -> pa.Table:
    """A row a sequence."""
    columns = {
        "key": pa.array([one.key for one in errors], pa.string()),
        "scene": pa.array([one.scene for one in errors], pa.string()),
        "poses": pa.array([one.poses for one in errors], pa.int64()),
        "refused": pa.array([one.refused for one in errors], pa.string()),
    }
    columns |= {name: pa.array([one.values[name] for one in errors], pa.float64()) for name in METRICS}
    return pa.table(columns)


def summary_table(summary: dict[str, object]) -> str:
    """Means with their intervals."""
    rows = [["metric", "mean over scenes", "95 % interval", "sequences"]]
    for name in METRICS:
        one = summary[name]
        if isinstance(one, dict):
            rows.append([name, f"{one['value']:.4f}", f"{one['low']:.4f} .. {one['high']:.4f}", str(one["sequences"])])
        else:
            rows.append([name, "-", "-", "0"])
    return aligned(rows) + f"\nrefused: {summary['refused'] or 'none'}"


def _estimator(release: Release, request: SlamRequest) -> Callable[[Clip, DecodedVideo], Reconstruction]:
    if request.model is not None and request.estimates is None:
        from pipelines.evaluating.slam_model import model_estimator  # other systems are evaluated without torch

        return model_estimator(request.model, release, release.codec(request.weights))
    if request.estimates is not None and request.model is None:
        folder = request.estimates
        return lambda clip, _: read_reconstruction(folder / clip.meta.key)
    raise ConfigError("an evaluation is of one system: name either --model or --estimates")
