"""An evaluation in its folder: driven episode by episode, on several workers, resumed where it was cut short.

OUT/settings.json       what fixes the folder
OUT/driven.jsonl        a record for each episode, written when it ends
OUT/summary.json        means with intervals
OUT/episodes.parquet    a row for each episode
OUT/maps/SCENE.png      the ways that were driven
OUT/episodes/UNIT.mp4   films
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from pipelines.evaluating.nav.config import NavConfig, fixed_settings, is_url
from pipelines.evaluating.nav.drive import Driven, SceneTask, drive_scene, unit_name
from pipelines.evaluating.nav.results import summarise, write_episodes_table
from pipelines.evaluating.nav.scenes import Scene, list_scenes
from pipelines.running.engines.local import run_local
from pipelines.running.folder import locked
from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import write_text
from wsm_data.files.differences import differences
from wsm_data.files.journal import JournalWriter, read_journal
from wsm_data.files.json_values import from_json, to_json

_JOURNAL = "driven"
Planned = Sequence[tuple[Scene, tuple[int, ...]]]


def evaluate_navigation(
    config: NavConfig, out: Path, *, episodes: int, workers: int, films: int, quiet: bool
) -> dict[str, Any]:
    """Drive what is not driven yet, and write tables, pictures and summary.

    Args:
        config: settings.
        out: the folder; it belongs to these settings alone.
        episodes: how many in all; with more of them the same folder goes on.
        workers: worker processes; 1 where the planner is a server.
        films: of the first so many episodes a film is written.
        quiet: no progress bar.

    Returns:
        The summary.

    Raises:
        ConfigError: the folder was made with other settings, or they cannot be met.
        IntegrityError: its records are damaged.
    """
    if is_url(config.planner) and workers > 1:
        raise ConfigError(
            f"a server of the protocol keeps one state for all who ask it: --workers must be 1 for {config.planner}, "
            f"found {workers}"
        )
    planned = list_scenes(config, episodes)
    with locked(out):
        _claim(out, fixed_settings(config))
        done = _read(out)
        tasks = pending_tasks(config, planned, done, out, films)
        total = sum(len(task.numbers) for task in tasks)
        with (
            JournalWriter(out, _JOURNAL) as journal,
            tqdm(total=total, unit="episode", desc="drive", disable=quiet, dynamic_ncols=True) as bar,
        ):
            for one in run_local(tasks, drive_scene, workers):
                journal.append(to_json(one))
                done[one.unit] = one
                bar.update()
        driven = [done[unit_name(scene.name, number)] for scene, numbers in planned for number in numbers]
        return _finish(config, out, driven)


def pending_tasks(
    config: NavConfig, planned: Planned, done: Mapping[str, Driven], out: Path, films: int
) -> list[SceneTask]:
    """A task for each scene in which an episode is to be driven, has no film and shall, or which has no map."""
    units = [(scene, number) for scene, numbers in planned for number in numbers]
    shown = {unit_name(scene.name, number) for scene, number in units[:films]}
    tasks = []
    for scene, numbers in planned:
        names = {number: unit_name(scene.name, number) for number in numbers}
        paths = {number: out / "episodes" / f"{name}.mp4" for number, name in names.items() if name in shown}
        missing = {number: path for number, path in paths.items() if not path.exists()}
        picture = out / "maps" / f"{scene.name}.png"
        pending = tuple(number for number in numbers if names[number] not in done or number in missing)
        before = tuple(done[names[number]] for number in numbers if number not in pending)
        if pending or not picture.exists():
            tasks.append(
                SceneTask(config=config, scene=scene, numbers=pending, before=before, picture=picture, films=missing)
            )
    return tasks


def _claim(out: Path, settings: dict[str, object]) -> None:
    """Write down the settings, or compare them with those that are there."""
    path = out / "settings.json"
    if not path.exists():
        write_text(path, json.dumps(settings, indent=1, sort_keys=True) + "\n")
        return
    try:
        before = json.loads(path.read_text())
    except ValueError as error:
        raise IntegrityError(f"{path} must be JSON, but: {error}; restore it, or use another --out") from error
    if changed := differences(before, settings):
        raise ConfigError(
            f"{out} was made with other settings; use another --out, or the same settings: {'; '.join(changed)}"
        )


def _read(out: Path) -> dict[str, Driven]:
    try:
        driven = [from_json(Driven, record) for record in read_journal(out, _JOURNAL)]
    except ValueError as error:
        raise IntegrityError(f"{out}/{_JOURNAL}.jsonl must hold episodes, but: {error}; use another --out") from error
    return {one.unit: one for one in driven}


def _finish(config: NavConfig, out: Path, driven: Sequence[Driven]) -> dict[str, Any]:
    write_episodes_table(out / "episodes.parquet", driven)
    summary = summarise(driven, config)
    write_text(out / "summary.json", json.dumps(summary, indent=1, sort_keys=True) + "\n")
    return summary
