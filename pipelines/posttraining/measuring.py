"""Pretrained and post-trained policy on the same queries of scenes that were not trained on."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace

import numpy as np
import torch
from tqdm import tqdm

from pipelines.posttraining.config import PosttrainRunConfig
from pipelines.posttraining.queries import queries_of
from wsm_data.loaders.config import Arrangement, LoaderConfig, OrderConfig, Remainder, SourceConfig
from wsm_data.loaders.queries import QueryLoader
from wsm_data.metrics.bootstrap import estimate_over_scenes
from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Session
from wsm_model.model import WorldSlamModel
from wsm_model.posttraining.adapters import AdaptedModel, Policy
from wsm_model.posttraining.rollout import Group, Query, generator_of, roll_out

MEASURES = ("mean_reward", "unsafe_share", "success_rate")


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What one query was like; means over its dreams.

    Attributes:
        scene: of the query.
        mean_reward: s exp(-C / T), which does not depend on the other dreams.
        unsafe_share: share of dreams whose footprint leaves free space.
        success_rate: share that is safe and keeps the expert's pace, C <= T.
    """

    scene: str
    mean_reward: float
    unsafe_share: float
    success_rate: float


def measured_queries(config: PosttrainRunConfig, device: torch.device) -> list[Query]:
    """The queries, one a clip, in an order of their seed alone; nothing where the release has no such split.

    Raises:
        ConfigError: no clip of the split is long enough for a query.
        IntegrityError: the release is damaged.
    """
    source = SourceConfig(release=config.source.release, split=config.measured.split)
    order = OrderConfig(
        seed=config.measured.seed,
        global_batch=1,
        remainder=Remainder.DROP,
        arrangement=Arrangement.PLAIN,
        chunk_sizes=(config.posttraining.session.chunk_size,),
    )
    read = replace(config.read, device=str(device), threads=1, prefetch_batches=1)
    settings = LoaderConfig(sources=(source,), order=order, read=read)
    found: list[Query] = []
    with QueryLoader(settings, replace(config.queries, queries_per_clip=1), rank=0, world_size=1) as loader:
        for batch in loader:
            found += queries_of(batch)
            if config.measured.queries and len(found) >= config.measured.queries:
                break
    return found


def measure_both(
    adapted: AdaptedModel, queries: Sequence[Query], config: PosttrainRunConfig, quiet: bool
) -> dict[str, object]:
    """`before`, `after` and their difference, each with an interval over scenes; every dream begins from one noise."""
    before = _measure(adapted.pretrained(), queries, config, "before", quiet)
    after = _measure(adapted.acting(Policy.TRAINED), queries, config, "after", quiet)
    scenes = [one.scene for one in before]
    seed = config.measured.seed
    found: dict[str, object] = {
        "queries": len(queries),
        "scenes": len(set(scenes)),
        "dreams": config.posttraining.group,
    }
    values = {
        name: {measure: np.array([getattr(one, measure) for one in rows]) for measure in MEASURES}
        for name, rows in (("before", before), ("after", after))
    }
    values["difference"] = {measure: values["after"][measure] - values["before"][measure] for measure in MEASURES}
    for name, columns in values.items():
        found[name] = {measure: asdict(estimate_over_scenes(columns[measure], scenes, seed)) for measure in MEASURES}
    return found


def _measure(
    acting: AbstractContextManager[WorldSlamModel],
    queries: Sequence[Query],
    config: PosttrainRunConfig,
    name: str,
    quiet: bool,
) -> list[Measured]:
    settings = config.posttraining
    schedule = flow_schedule(settings.flow_steps, settings.flow_shift)
    with acting as model:
        session = Session(model, settings.session)
        return [
            _measured(query, _dreamt(session, query, config, schedule), settings.reward.temperature_m2)
            for query in tqdm(queries, desc=name, unit="query", disable=quiet, dynamic_ncols=True)
        ]


def _dreamt(session: Session, query: Query, config: PosttrainRunConfig, schedule: Sequence[float]) -> Group:
    settings = config.posttraining
    shape = (settings.group, settings.session.chunk_size, *query.rgb.shape[1:])
    noise = torch.randn(shape, generator=generator_of(query, config.measured.seed, 0)).to(query.rgb.device)
    return roll_out(session, query, noise, schedule, settings.reward)


def _measured(query: Query, group: Group, temperature_m2: float) -> Measured:
    scored = group.scored
    return Measured(
        scene=query.scene,
        mean_reward=float(scored.value.mean()),
        unsafe_share=float(1 - scored.safe.mean()),
        success_rate=float((scored.safe & (scored.cost_m2 <= temperature_m2)).mean()),
    )
