"""The tables of docs/curation.md are what the code says of scores and rollouts."""

import re
from pathlib import Path

import pytest

from wsm_data.curation.rollouts import ROLLOUT_SCORES, rollout_schema
from wsm_data.curation.score_clip import CLIP_SCORES
from wsm_data.curation.scorers import clearance, dead_end, passage, trajectory, turning, unknown_map, view_change
from wsm_data.curation.scores_table import Direction

PAGE = (Path(__file__).parents[2] / "docs" / "curation.md").read_text()
ENDS = {Direction.HIGHER: "high", Direction.LOWER: "low", Direction.NEUTRAL: "none"}


def rows_below(heading):
    """Cells of the first table below a heading."""
    section = PAGE.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in section.splitlines() if "|" in line][2:]


@pytest.mark.parametrize(("heading", "scores"), [("### What is scored", CLIP_SCORES), ("## Rollouts", ROLLOUT_SCORES)])
def test_every_score_stands_there_in_order_with_its_unit_and_hard_end(heading, scores):
    names = {f"`{one.name}`" for one in scores}
    written = [tuple(row[:3]) for row in rows_below(heading) if row[0] in names]
    assert written == [(f"`{one.name}`", one.unit, ENDS[one.direction]) for one in scores]


def test_the_columns_of_rollouts_are_those_of_the_schema():
    wanted = [
        (f"`{field.name}`", str(field.type).replace("string", "text").replace("double", "float64"))
        for field in rollout_schema("d")
    ]
    assert [tuple(row[:2]) for row in rows_below("## Rollouts")][: len(wanted)] == wanted


def test_the_numbers_of_the_definitions_are_those_of_the_code():

    rows = {row[0].strip("`"): " ".join(row[1:]) for row in rows_below("### What is scored")}
    for name, numbers in {
        "turning_sharpest_rad": [turning.SHARP_TURN_M],
        "clearance_least_m": [trajectory.CLEARANCE_CAP_M],
        "clearance_tight_share": [clearance.TIGHT_M],
        "passage_narrowest_m": [
            passage.END_M,
            passage.CORRIDOR_M,
            2 * (trajectory.CLEARANCE_CAP_M - passage.CORRIDOR_M),
        ],
        "dead_end_share": [dead_end.TRAPPED_M],
        "map_unknown_share": [unknown_map.BAND_M],
        "view_change_rad_per_frame": [view_change.NEAREST_M, view_change.FARTHEST_M],
    }.items():
        found = set(re.findall(r"\d+(?:\.\d+)?", rows[name]))
        assert {f"{number:g}" for number in numbers} <= found, name
