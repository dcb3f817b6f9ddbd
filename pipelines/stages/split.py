"""`wsm split`: which trajectories are for training, and which for the SLAM test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.artifacts.episode_table import EpisodeRow, read_episodes
from pipelines.artifacts.split_table import SPLIT_FILE, write_split
from pipelines.running.stage import Outcome, Stage, StageContext, Unit
from pipelines.running.upstream import require_stage
from wsm_data.curation.split import SplitBy, leaking_scenes, split_together
from wsm_data.files.digest import digest_json, sha256_file
from wsm_data.files.typed_toml import INPUT

_UNIT = "split"


@dataclass(frozen=True, kw_only=True)
class SplitConfig:
    """Settings of `wsm split`. Trajectories of equal content go to one side (`index` keeps them if it is told to).

    Attributes:
        index: folder of `wsm index`.
        by: `trajectory`, as the paper does, or `scene`: a physical scene goes to one side with all its cameras.
        test_fraction: expected share of the test side; the paper holds out 5 % (section 4.1).
        seed: another seed, another deal.
    """

    index: Path = field(metadata=INPUT)
    by: SplitBy = SplitBy.TRAJECTORY
    test_fraction: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.test_fraction < 1:
            raise ValueError(f"test_fraction must lie in [0, 1), found {self.test_fraction}")


def _list_units(config: SplitConfig) -> Sequence[Unit]:
    require_stage(config.index, "index")
    rows = read_episodes(config.index)
    first: dict[str, str] = {}
    names = [(row.id.text, first.setdefault(row.digest, row.id.text)) for row in rows]  # and whose content they share
    return [Unit(id=_UNIT, inputs={"episodes": digest_json(names)}, payload=rows)]


def _process(batch: Sequence[Unit], config: SplitConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        rows: Sequence[EpisodeRow] = unit.payload
        digests = {row.id: row.digest for row in rows}
        splits = split_together(digests, config.by, config.test_fraction, config.seed)
        write_split(context.out, splits)
        tests = sum(split == "test" for split in splits.values())
        leaks = leaking_scenes(splits)
        facts = {
            "train": len(splits) - tests,
            "test": tests,
            "test scenes": len({one.physical_scene for one, split in splits.items() if split == "test"}),
            "test scenes also in training": len(leaks),
        }
        yield Outcome(unit=unit.id, digest=sha256_file(context.out / SPLIT_FILE), outputs=(SPLIT_FILE,), facts=facts)


STAGE = Stage(
    name="split",
    version=1,
    config_type=SplitConfig,
    list_units=_list_units,
    process=_process,
)
