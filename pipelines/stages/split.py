"""`wsm split`: which trajectories are for training, and which for the SLAM test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.config import INPUT
from pipelines.episode_table import EpisodeRow, read_episodes
from pipelines.stage import Outcome, Stage, StageContext, Unit
from pipelines.upstream import require_stage
from wsm_data.curation.split import SplitBy, leaking_scenes, split_of
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import digest_json
from wsm_data.files.jsonlines import read_lines, write_lines

SPLIT_FILE = "split.jsonl"
_UNIT = "split"


@dataclass(frozen=True, kw_only=True)
class SplitConfig:
    """Settings of `wsm split`.

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


def read_split(folder: Path) -> dict[str, str]:
    """Split of every trajectory (`train` or `test`) by its id.

    Raises:
        IntegrityError: the table is gone although the stage says that it is done.
    """
    path = folder / SPLIT_FILE
    if not path.exists():
        raise IntegrityError(f"{path} is missing; run `wsm split` again")
    return {str(line["id"]): str(line["split"]) for line in read_lines(path)}


def _list_units(config: SplitConfig) -> Sequence[Unit]:
    require_stage(config.index, "index")
    rows = read_episodes(config.index)
    return [Unit(id=_UNIT, inputs={"episodes": digest_json([row.id.text for row in rows])}, payload=rows)]


def _process(batch: Sequence[Unit], config: SplitConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        rows: Sequence[EpisodeRow] = unit.payload
        splits = {row.id: split_of(row.id, config.by, config.test_fraction, config.seed) for row in rows}
        records = [{"id": one.text, "split": split} for one, split in splits.items()]
        write_lines(context.out / SPLIT_FILE, records)
        tests = sum(split == "test" for split in splits.values())
        leaks = leaking_scenes(splits)
        facts = {
            "train": len(splits) - tests,
            "test": tests,
            "test scenes": len({one.physical_scene for one, split in splits.items() if split == "test"}),
            "test scenes also in training": len(leaks),
        }
        yield Outcome(unit=unit.id, digest=digest_json(records), outputs=(SPLIT_FILE,), facts=facts)


STAGE = Stage(
    name="split",
    version=1,
    summary="Deal trajectories, or whole scenes, to training and test by a hash.",
    config_type=SplitConfig,
    list_units=_list_units,
    process=_process,
)
