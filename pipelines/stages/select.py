"""`wsm select`: the hard share of a release as a list of clips, with the reasons."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import pyarrow as pa

from pipelines.artifacts.release_files import content_digest, copy_into_release
from pipelines.running.command_text import command_text
from pipelines.running.settings import settings_of
from pipelines.running.stage import Outcome, Stage, StageContext, Unit
from wsm_data.access.release import Release, open_release, read_manifest
from wsm_data.curation.scores_table import ScoreTable, read_paths, read_scorers, read_scores
from wsm_data.curation.select import INDEX_COLUMNS, ChosenClips, SelectionConfig, select_clips
from wsm_data.errors import IntegrityError
from wsm_data.files.differences import differences
from wsm_data.files.digest import sha256_file
from wsm_data.files.stores import open_store
from wsm_data.files.typed_toml import INPUT
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.selection import (
    SELECTION_SUFFIX,
    Selection,
    parse_selection,
    require_selection_name,
    selection_path,
    write_selection,
)

_LOG = logging.getLogger(__name__)
UNIT = "selection"


@dataclass(frozen=True, kw_only=True)
class SelectConfig(SelectionConfig):
    """Settings of `wsm select`: those of `SelectionConfig`, and these.

    Attributes:
        release: folder or URL of the release.
        scores: path or URL of its scores; where it is not given, scores.parquet in the release.
        name: name of the selection.
    """

    release: str = field(metadata=INPUT)
    scores: str = field(default="", metadata=INPUT)
    name: str = "hard"

    def __post_init__(self) -> None:
        super().__post_init__()
        require_selection_name(self.name)

    @property
    def scores_location(self) -> str:
        """Where the scores are."""
        return self.scores or f"{self.release.rstrip('/')}/{SCORES_NAME}"

    @property
    def file_name(self) -> str:
        """File of the selection in the folder of the stage."""
        return f"{self.name}{SELECTION_SUFFIX}"


def _list_units(config: SelectConfig) -> Sequence[Unit]:
    digest = release_digest(read_manifest(open_store(config.release)))
    return [Unit(id=UNIT, inputs={"manifest": digest, "scores": _scores_digest(config.scores_location)})]


def _process(batch: Sequence[Unit], config: SelectConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        release = open_release(config.release)
        index = release.index.columns(INDEX_COLUMNS)
        scores = _needed_scores(release, config, index["key"])
        index = index.drop_columns(["key"])  # the scores have the same
        pa.default_memory_pool().release_unused()  # what reading took, and sorting now needs
        chosen = select_clips(index, scores, partial(read_paths, config.scores_location), config)
        path = context.out / config.file_name
        write_selection(path, _selection(config, scores, chosen, unit.inputs["scores"]))
        facts = {
            "clips chosen": len(chosen.rows),
            "of trajectories": chosen.trajectories,
            "near-duplicates left out": chosen.near_duplicates,
            "over quota": chosen.over_quota,
        }
        yield Outcome(unit=unit.id, digest=sha256_file(path), outputs=(config.file_name,), facts=facts)


def _needed_scores(release: Release, config: SelectConfig, keys: pa.ChunkedArray) -> ScoreTable:
    """The scores that the settings name, of the clips with these keys."""
    return read_scores(
        config.scores_location,
        release_digest=release.digest,
        release_keys=keys,
        only=config.score_names(read_scorers(config.scores_location)),
    )


def install_selection(path: Path, config: SelectConfig) -> None:
    """Put the selection into its release, where loaders find it by its name; nothing is done where that is read-only.

    Where one of other settings stands there under its name, it is replaced, and that is announced.
    """
    name = selection_path(config.name)
    installed = Path(config.release) / name
    old = installed.read_bytes() if installed.is_file() else b""  # behind a URL there is none
    if copy_into_release(path, config.release, name) and old:
        _announce_replacement(installed, old, path.read_bytes())


def _announce_replacement(installed: Path, old: bytes, new: bytes) -> None:
    if old == new:
        return
    try:
        before = parse_selection(old, str(installed)).rule.get("settings", {})
    except IntegrityError as error:
        _LOG.warning("%s is replaced: %s", installed, error)
        return
    changes = differences(before, parse_selection(new, str(installed)).rule.get("settings", {}))
    if changes:
        _LOG.warning("%s is replaced by a selection with other settings: %s", installed, "; ".join(changes))


def _selection(config: SelectConfig, scores: ScoreTable, chosen: ChosenClips, scores_digest: str) -> Selection:
    return Selection(
        name=config.name,
        release_digest=scores.release_digest,
        rule=_rule(config, scores, chosen, scores_digest),
        command=_command(config),
        keys=scores.keys.take(pa.array(chosen.rows)),
        scores=chosen.difficulty,
        why=chosen.why,
    )


def _command(config: SelectConfig) -> str:
    """The command that was run; RELEASE and SCORES stand for where these lie, which is no part of a selection."""
    text = command_text("wsm select RELEASE", config, SelectConfig(release=config.release))
    return f"{text} --set scores=SCORES" if config.scores else text


def _rule(config: SelectConfig, scores: ScoreTable, chosen: ChosenClips, scores_digest: str) -> dict[str, object]:
    """Everything the choice depended on, defaults written out, and what became of the clips."""
    return {
        "settings": settings_of(config),
        "scores_digest": scores_digest,
        "scores": {
            one.name: {"unit": one.unit, "direction": one.direction.value, "version": one.version}
            for one in scores.scorers
        },
        "stage_version": STAGE.version,
        "clips": {
            "of the split": chosen.trajectories,
            "excluded": dict(chosen.excluded),
            "near-duplicates left out": chosen.near_duplicates,
            "over quota": chosen.over_quota,
            "chosen": len(chosen.rows),
        },
    }


def _scores_digest(location: str) -> str:
    """Scores are told apart by their bytes; parquet's checksums vouch for its pages."""
    return content_digest(location, f"there are no scores at {location}; run `wsm score RELEASE` first")


STAGE = Stage(name="select", version=2, config_type=SelectConfig, list_units=_list_units, process=_process)
