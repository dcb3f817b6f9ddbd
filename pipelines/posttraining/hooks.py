"""What a run of post-training tells and draws on its way, and a word where its groups teach nothing."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tqdm import tqdm

from pipelines.posttraining.config import PosttrainRunConfig
from pipelines.posttraining.pictures import draw_groups, film_group
from pipelines.training.data import decoding_of
from wsm_data.access.release import Release
from wsm_data.loaders.queries import QueryLoader
from wsm_model.posttraining.step import RolledOut
from wsm_model.ranks import rank_and_world_size
from wsm_model.training.loop import Hooks, total_steps
from wsm_model.training.metrics import metrics_writer

_LOG = logging.getLogger(__name__)
_FLAT = 1e-6
"""Rewards of a group that differ by less, in standard deviation, teach nothing."""
_TELL_AFTER = 32
"""Groups after which it is told that most are flat."""


@dataclass(kw_only=True)
class Progress:
    """Where the run stands, and what its groups were like.

    Attributes:
        done: steps.
        groups: rolled out in this process.
        flat: of these, in how many every dream had the same reward.
        skipped: of these, in how many no dream was safe.
        last: of the last step.
    """

    done: int = 0
    groups: int = 0
    flat: int = 0
    skipped: int = 0
    last: list[RolledOut] = field(default_factory=list)


@contextmanager
def posttraining_hooks(
    config: PosttrainRunConfig,
    out: Path,
    loader: QueryLoader,
    progress: Progress,
    release: Release,
    must_stop: Callable[[], bool],
    quiet: bool,
) -> Iterator[Hooks]:
    """Metrics, pictures and the progress bar of the first rank; nothing on others."""
    rank, _ = rank_and_world_size()
    if rank:
        nothing = Hooks(
            metrics=lambda _step, _values: None,
            sample=lambda _step: None,
            progress=lambda _done: None,
            must_stop=must_stop,
        )
        yield nothing
        return
    steps = total_steps(config.posttraining, loader)
    with (
        metrics_writer(out, progress.done) as write,
        tqdm(
            total=steps, initial=progress.done, unit="step", desc="posttrain", disable=quiet, dynamic_ncols=True
        ) as bar,
    ):

        def show(step: int, values: Mapping[str, float]) -> None:
            write(step, values)
            bar.set_postfix({name: f"{values[name]:.3f}" for name in ("reward", "unsafe_share")}, refresh=False)

        def move(now: int) -> None:
            bar.update(now - bar.n)

        def sample(step: int) -> None:
            folder = out / "samples"
            folder.mkdir(exist_ok=True)
            shown = progress.last[:8]
            draw_groups(shown, f"groups of step {step}", folder / f"step-{step:06d}.png")
            decoding = decoding_of(release.manifest, config.codec_weights, config.read.standard)
            film_group(shown[0], decoding, folder / f"step-{step:06d}.mp4")

        yield Hooks(metrics=show, sample=sample, progress=move, must_stop=must_stop)


def count_groups(progress: Progress, rolled: list[RolledOut]) -> None:
    """Count the groups of a step, and warn once where most of the first teach nothing."""
    progress.last = rolled or progress.last
    before = progress.groups
    progress.groups += len(rolled)
    progress.skipped += sum(not one.group.scored.tells for one in rolled)
    progress.flat += sum(float(one.group.scored.reward.std()) < _FLAT for one in rolled)
    if before < _TELL_AFTER <= progress.groups and progress.flat > progress.groups / 2:
        advice = (
            "in most of them no dream was safe: take a selection that is less hard, or a model that was trained longer"
            if progress.skipped > progress.flat / 2
            else "raise posttraining.reward.temperature_m2 where all costs are far above it, lower it where all are "
            "far below, or raise posttraining.group"
        )
        _LOG.warning(
            "in %d of the first %d groups every dream got the same reward, so nothing is learned there; %s",
            progress.flat,
            progress.groups,
            advice,
        )
