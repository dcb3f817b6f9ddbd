"""Rows of a table from the summaries of evaluations."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipelines.evaluating.tables.paper import PaperTable
from pipelines.evaluating.tables.row import UNKNOWN, Figure, TableRow
from wsm_data.errors import ConfigError, IntegrityError


def measured_row(word: str, table: PaperTable) -> TableRow:
    """The row of an evaluation.

    Args:
        word: `DIR` or `LABEL=DIR`, where DIR holds the summary.json of `wsm eval nav` or `wsm eval slam`.
        table: whose columns are wanted.

    Raises:
        ConfigError: there is no summary, or it is one of another kind of evaluation.
        IntegrityError: it is no JSON object.
    """
    label, _, folder = word.rpartition("=")
    path = Path(folder) / "summary.json"
    summary = _read(path)
    missing = [name for name, _ in table.columns.values() if name not in summary]
    if missing:
        raise ConfigError(
            f"{path} must have the numbers of this table ({', '.join(missing)} missing); name a folder of the "
            f"evaluation that has them: nav for driving, slam for poses and points"
        )
    figures = {
        column: _figure(summary[name], factor)
        for column, (name, factor) in table.columns.items()
        if summary[name] is not None
    }
    return TableRow(
        system=label or str(summary.get("planner") or Path(str(summary["system"])).name),
        source="measured",
        data=_data(summary),
        inputs=_inputs(summary.get("inputs")),
        goal=summary.get("goal", UNKNOWN),
        controller_pose=summary.get("controller_pose", UNKNOWN),
        protocol=summary.get("protocol", UNKNOWN),
        figures=figures,
    )


def _read(path: Path) -> Mapping[str, Any]:
    try:
        summary = json.loads(path.read_text())
    except FileNotFoundError as error:
        raise ConfigError(f"there must be a file {path}, and is none; evaluate first") from error
    except ValueError as error:
        raise IntegrityError(f"{path} must be JSON, but: {error}; evaluate again") from error
    if not isinstance(summary, dict):
        raise IntegrityError(f"{path} must be a JSON object, found {type(summary).__name__}; evaluate again")
    return summary


def _data(summary: Mapping[str, Any]) -> str:
    if "world" in summary:
        return f"{summary['world']}, {summary['episodes']} episodes"
    return f"release {summary['release'][:8]}, {summary['split']}, {summary['sequences']} sequences"


def _inputs(names: Sequence[str] | None) -> str:
    return UNKNOWN if names is None else ", ".join(name for name in names if name != "goal") or "none"


def _figure(estimate: Mapping[str, float], factor: float) -> Figure:
    return Figure(**{end: factor * estimate[end] for end in ("value", "low", "high")})
