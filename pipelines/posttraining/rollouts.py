"""The table of rollouts of a run: a row a query, as `wsm score` reads it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import torch

from wsm_data.access.release import Release
from wsm_data.curation.rollouts import rollout_schema
from wsm_data.files.jsonlines import read_lines
from wsm_data.files.tables import write_table
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.flow import noised
from wsm_model.inference.passes import velocity
from wsm_model.inference.sampler import flow_schedule
from wsm_model.posttraining.adapters import AdaptedModel
from wsm_model.posttraining.config import PosttrainingConfig
from wsm_model.posttraining.rollout import Query, generator_of
from wsm_model.posttraining.step import RolledOut
from wsm_model.precision import autocast, stored_precision

ROLLOUT_LINES = "rollouts.jsonl"
ROLLOUTS_TABLE = "rollouts.parquet"


def rollout_row(rolled: RolledOut, policy: str, fm_loss: float) -> dict[str, object]:
    """What a query was like for a policy."""
    query, group = rolled.query, rolled.group
    safe = group.scored.safe & np.isfinite(group.scored.cost_m2)
    return {
        "key": query.key,
        "replan_latent": query.replan_latent,
        "policy": policy,
        "dreams": len(safe),
        "unsafe_share": float(1 - safe.mean()),
        "mean_cost_m2": float(group.scored.cost_m2[safe].mean()) if safe.any() else None,
        "ate_rmse_sim3_m": group.ate_rmse_sim3_m,
        "fm_loss": fm_loss,
    }


@torch.no_grad()
def flow_matching_loss(
    adapted: AdaptedModel, rolled: RolledOut, future_KChw: torch.Tensor, config: PosttrainingConfig, epoch: int
) -> float:
    """Mean squared error of the trained velocity at the sampler's flow times, of the real future of a query."""
    query, history = rolled.query, rolled.group.episode.history
    device, draws = query.rgb.device, generator_of(query, config.seed + 2, epoch)
    future = future_KChw.to(device)[None]
    errors = []
    for flow_time in flow_schedule(config.flow_steps, config.flow_shift)[:-1]:
        noise = torch.randn(future.shape, generator=draws).to(device)
        tau = torch.tensor([flow_time], dtype=torch.float32, device=device)
        with autocast(stored_precision(adapted.model), device):
            context = adapted.model.goal(query.goal_camera0_m[None])[:, None, None].expand(-1, future.shape[1], -1, -1)
            found = velocity(adapted.model, [history], noised(future, noise, tau), tau, context)
        errors.append(float((found - (noise - future)).square().mean()))
    return float(np.mean(errors))


def real_future(release: Release, query: Query, standard: LatentStandard, latents: int) -> torch.Tensor:
    """Standardised RGB latents that were recorded after a query; float32 [K, C, h, w]."""
    clip = release[query.key]
    first = query.replan_latent + 1
    return torch.from_numpy(standard.standard_rgb(clip.rgb_latent[first : first + latents].astype(np.float32)))


def write_rollouts(path: Path, rows: Sequence[Mapping[str, object]], release_digest: str) -> None:
    """Write the table, sorted by policy, clip and latent; of a query that was done again the last row stays."""
    latest = {(str(row["policy"]), str(row["key"]), int(str(row["replan_latent"]))): row for row in rows}
    table = pa.Table.from_pylist([dict(latest[key]) for key in sorted(latest)], schema=rollout_schema(release_digest))
    write_table(path, table, compression="zstd")


def read_rows(folder: Path, done: int) -> list[dict[str, object]]:
    """Rows of the steps that are done, of all ranks; those of a killed run's later steps are left out."""
    return [
        {name: value for name, value in line.items() if name != "step"}
        for path in sorted(folder.glob(f"*{ROLLOUT_LINES}"))
        for line in read_lines(path)
        if int(str(line["step"])) <= done
    ]
