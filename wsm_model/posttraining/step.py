"""One step of post-training: dreams of the old policy are scored, and the trained one learns from them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from wsm_model.flow import noised
from wsm_model.inference.cache import History
from wsm_model.inference.passes import velocity
from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Session
from wsm_model.posttraining.adapters import AdaptedModel, Policy
from wsm_model.posttraining.advantages import Spread, advantages, optimality
from wsm_model.posttraining.config import PosttrainingConfig
from wsm_model.posttraining.objective import Velocities, nft_loss
from wsm_model.posttraining.rollout import Group, Query, generator_of, roll_out
from wsm_model.precision import autocast, stored_precision
from wsm_model.ranks import rank_and_world_size, sum_over_ranks
from wsm_model.training.loop import StepResult, TrainingRun, finish_step


@dataclass(frozen=True, kw_only=True, eq=False)
class RolledOut:
    """A query with its group."""

    query: Query
    group: Group


def roll_out_all(
    adapted: AdaptedModel, queries: Sequence[Query], config: PosttrainingConfig, epoch: int
) -> list[RolledOut]:
    """Groups of the old policy, one query after the other: G rows share one history."""
    schedule = flow_schedule(config.flow_steps, config.flow_shift)
    found = []
    with adapted.acting(Policy.OLD) as model:
        session = Session(model, config.session)
        for query in queries:
            shape = (config.group, config.session.chunk_size, *query.rgb.shape[1:])
            noise = torch.randn(shape, generator=generator_of(query, config.seed, epoch)).to(query.rgb.device)
            found.append(RolledOut(query=query, group=roll_out(session, query, noise, schedule, config.reward)))
    return found


def posttraining_step(
    adapted: AdaptedModel, run: TrainingRun, config: PosttrainingConfig, rolled: Sequence[RolledOut], epoch: int
) -> StepResult:
    """One step of the optimiser on this rank's queries of a global step.

    Means are over all queries of the global step, so the number of ranks does not change them. A group in which no
    dream is safe is skipped: it counts, and adds nothing.

    Raises:
        NumericalError: a loss or a gradient is not finite.
    """
    device = next(adapted.model.parameters()).device
    count, rewards, squares = sum_over_ranks(
        [float(len(rolled)), *_moments([one.group.scored.reward for one in rolled])], device
    )
    spread = None
    if config.spread is Spread.STEP:
        total = max(1.0, count * config.group)
        spread = float(np.sqrt(max(0.0, squares / total - (rewards / total) ** 2)))
    run.optimiser.zero_grad(set_to_none=True)
    sums = dict.fromkeys(("loss", "positive", "negative", "reference"), 0.0)
    for one in rolled:
        for name, value in _learn(adapted, one, config, epoch, spread, count).items():
            sums[name] += value
    _average_gradients(adapted.trained())
    told = sums | _summary(rolled, count)
    names = sorted(told)
    totals = dict(zip(names, sum_over_ranks([told[name] for name in names], device), strict=True))
    keys = ", ".join(one.query.key for one in rolled)
    return finish_step(
        run, totals, config.optimiser.clip_norm, lambda wrong: f"{wrong} must be finite, at the queries of {keys}"
    )


def _learn(
    adapted: AdaptedModel, rolled: RolledOut, config: PosttrainingConfig, epoch: int, spread: float | None, count: float
) -> dict[str, float]:
    """Gradients of one group, and its share of the losses."""
    query, group = rolled.query, rolled.group
    if not group.scored.tells:
        return {}
    device = group.rgb.device
    rho = torch.from_numpy(optimality(advantages(group.scored.reward, spread), config.objective.advantage_max))
    draws = generator_of(query, config.seed + 1, epoch)
    order = torch.stack([torch.randperm(config.flow_steps, generator=draws) for _ in range(config.group)])
    sigmas = torch.tensor(flow_schedule(config.flow_steps, config.flow_shift)[:-1], dtype=torch.float32)
    sums: dict[str, float] = {}
    for number in range(config.objective.flow_times):
        tau = sigmas[order[:, number]].to(device)
        noise = torch.randn(group.rgb.shape, generator=draws).to(device)
        noisy = noised(group.rgb, noise, tau)
        histories = [group.episode.history] * config.group
        velocities = _velocities(adapted, histories, noisy, tau, query.goal_camera0_m)
        terms = nft_loss(velocities, group.rgb, noisy, tau, rho.to(device), config.objective)
        share = 1 / (config.objective.flow_times * count)
        (terms.loss * share).backward()
        for name in ("loss", "positive", "negative", "reference"):
            sums[name] = sums.get(name, 0.0) + float(getattr(terms, name).detach()) * share
    return sums


def _velocities(
    adapted: AdaptedModel, histories: Sequence[History], noisy: Tensor, tau: Tensor, goal_camera0_m: Tensor
) -> Velocities:
    def of_policy() -> Tensor:
        model = adapted.model
        with autocast(stored_precision(model), noisy.device):
            context = model.goal(goal_camera0_m[None])[:, None, None].expand(len(noisy), noisy.shape[1], -1, -1)
            return velocity(model, histories, noisy, tau, context)

    with torch.no_grad():
        with adapted.acting(Policy.OLD):
            old = of_policy()
        with adapted.pretrained():
            reference = of_policy()
    return Velocities(trained=of_policy(), old=old, reference=reference)


def _average_gradients(parameters: Sequence[torch.nn.Parameter]) -> None:
    """Sum the gradients of all ranks: each rank's are already shares of the global mean."""
    _, world_size = rank_and_world_size()
    for parameter in parameters:
        if parameter.grad is None:  # no group of this rank told anything
            parameter.grad = torch.zeros_like(parameter)
        if world_size > 1:
            torch.distributed.all_reduce(parameter.grad)


def _moments(rewards: Sequence[np.ndarray]) -> list[float]:
    return [float(sum(one.sum() for one in rewards)), float(sum((one**2).sum() for one in rewards))]


def _summary(rolled: Sequence[RolledOut], count: float) -> dict[str, float]:
    """Shares of the means over all queries of what is told of groups."""
    scored = [one.group.scored for one in rolled]
    return {
        "reward": sum(float(one.value.mean()) for one in scored) / count,
        "unsafe_share": sum(float(1 - one.safe.mean()) for one in scored) / count,
        "reward_spread": sum(float(one.reward.std()) for one in scored) / count,
        "skipped_share": sum(float(not one.tells) for one in scored) / count,
    }
