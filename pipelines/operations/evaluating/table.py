"""`wsm eval table`: a table of the paper with evaluations of one's own beside it, as text, CSV and picture."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import typer

from pipelines.evaluating.tables.measured import measured_row
from pipelines.evaluating.tables.paper import PAPER_TABLES, PaperTable
from pipelines.evaluating.tables.row import UNKNOWN, Figure, TableRow
from wsm_data.files.atomic import write_text
from wsm_data.view.drawing.intervals import Bar, draw_intervals
from wsm_data.view.drawing.text_table import aligned

_FACTS = ("system", "source", "data", "inputs", "goal", "controller_pose", "protocol")


def eval_table(name: str, evaluations: Sequence[str], out: Path) -> None:
    """Write NAME.txt, NAME.csv and NAME.png, and print the text.

    Args:
        name: of the table.
        evaluations: `DIR` or `LABEL=DIR` words.
        out: folder to write.

    Raises:
        ConfigError: an evaluation has no summary, or one of another kind.
        IntegrityError: a summary is damaged.
    """
    table = PAPER_TABLES[name]
    rows = [*table.rows, *(measured_row(word, table) for word in evaluations)]
    text = f"{table.caption} ({'lower' if table.lower_is_better else 'higher'} is better)\n{as_text(table, rows)}\n"
    write_text(out / f"{name}.txt", text)
    write_text(out / f"{name}.csv", as_csv(table, rows))
    draw_intervals({column: _bars(column, rows) for column in table.columns}, table.caption, out / f"{name}.png")
    typer.echo(text + f"text, CSV and picture: {out / name}.*")


def as_text(table: PaperTable, rows: Sequence[TableRow]) -> str:
    """Aligned columns; an interval stands behind a number that has one."""
    header = [*_FACTS, *table.columns]
    lines = [[*_facts(row), *(_shown(row.figures.get(column)) for column in table.columns)] for row in rows]
    return aligned([header, *lines])


def as_csv(table: PaperTable, rows: Sequence[TableRow]) -> str:
    """One line a row; each number with its `low` and `high`, empty where there is none."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*_FACTS, *(f"{column}{end}" for column in table.columns for end in ("", " low", " high"))])
    for row in rows:
        ends = [_ends(row.figures.get(column)) for column in table.columns]
        writer.writerow([*_facts(row), *("" if one is None else repr(one) for three in ends for one in three)])
    return buffer.getvalue()


def _facts(row: TableRow) -> list[str]:
    return [getattr(row, name) for name in _FACTS]


def _ends(figure: Figure | None) -> tuple[float | None, float | None, float | None]:
    return (None, None, None) if figure is None else (figure.value, figure.low, figure.high)


def _shown(figure: Figure | None) -> str:
    value, low, high = _ends(figure)
    if value is None:
        return UNKNOWN
    return f"{value:.4g}" if low is None or high is None else f"{value:.4g} [{low:.4g}, {high:.4g}]"


def _bars(column: str, rows: Sequence[TableRow]) -> list[Bar]:
    bars = []
    for row in rows:
        value, low, high = _ends(row.figures.get(column))
        if value is not None:
            interval = None if low is None or high is None else (low, high)
            name = f"{row.system} ({row.data})"
            bars.append(Bar(name=name, value=value, interval=interval, muted=row.source == "paper"))
    return bars
