"""Damaged files of a run: the next commands refuse, repair, or lose nothing by it; no byte changes unseen."""

import random
import shutil
from collections import Counter
from pathlib import Path

import pytest

from pipelines.running.upstream import done_outcomes, vouched_by_ledger
from wsm_data.access.verify import verify_release
from wsm_data.errors import WsmError
from wsm_data.files.journal import read_journal, rewrite_journal

STAGES = ("index", "split", "map", "encode", "pack", "verify", "score", "select")
RESULTS = ("pack/release/*", "score/scores.parquet", "select/hard.parquet")
UNSEEN_S = 1e6
ATTEMPTS = 4
"""A person runs the same command again after a refusal: a stage that finds damage has the one before write anew."""


def flipped(data, chance):
    place = chance.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << chance.randrange(8)]) + data[place + 1 :]


def cut(data, chance):
    return data[: chance.randrange(len(data))]


def swapped(data, chance):
    """Two neighbouring pieces change places: every byte is still there."""
    size = min(16, len(data) // 2) or 1
    start = chance.randrange(len(data) - 2 * size + 1) if len(data) >= 2 * size else 0
    one, two = data[start : start + size], data[start + size : start + 2 * size]
    return data[:start] + two + one + data[start + 2 * size :]


DAMAGES = (flipped, cut, swapped)


@pytest.fixture(scope="module")
def again(make_source, run_pipeline):
    """Runs all commands on a folder, as a person does who types them again."""
    source = make_source(trajectories=3)
    settings = {"select": {"fraction": 0.5}}
    return lambda out: run_pipeline(source, out, stages=STAGES, settings=settings)


@pytest.fixture(scope="module")
def whole(tmp_path_factory, again):
    """A finished run, and what it made."""
    out = tmp_path_factory.mktemp("damages") / "whole"
    again(out)
    return out


def results(out):
    paths = sorted(path for pattern in RESULTS for path in out.glob(pattern) if path.is_file())
    return {str(path.relative_to(out)): path.read_bytes() for path in paths}


def hide_from_the_clock(out):
    """Make the ledgers younger than any damage, as a disk does that changes bytes without telling the system."""
    for stage in STAGES:
        lines = [{**line, "time": line["time"] + UNSEEN_S} for line in read_journal(out / stage, "ledger")]
        rewrite_journal(out / stage, "ledger", [{k: v for k, v in line.items() if k != "xxh3"} for line in lines])


def damaged_files(out):
    return sorted(path for path in out.rglob("*") if path.is_file() and path.stat().st_size and path.name != ".lock")


def require_selection(out):
    """What `wsm select` does before it hands a selection on."""
    (outcome,) = done_outcomes(out / "select").values()
    vouched_by_ledger(out / "select", outcome, out / "select/hard.parquet")


def what_follows(run, out, wanted, planted):
    """`harmless`, `repaired`, or `refused` for good; anything but a foreseen error ends the test."""
    for attempt in range(ATTEMPTS):
        try:
            run(out)
            require_selection(out)
        except WsmError as error:
            said = str(error)
            continue
        found = results(out)
        assert [name for name, data in wanted.items() if found.get(name) != data] == [], planted
        assert verify_release(out / "pack" / "release") == []
        return "repaired" if attempt else "harmless or repaired"
    assert "Traceback" not in said
    return "refused"


@pytest.mark.parametrize(
    "count", [pytest.param(12), pytest.param(400, marks=[pytest.mark.slow, pytest.mark.timeout(7200)])]
)
def test_after_any_damage_the_results_are_the_same_or_the_next_commands_say_no(count, whole, again, tmp_path, faults):
    chance = random.Random(count)
    wanted = results(whole)
    seen = Counter()
    for number in range(count):
        out = Path(shutil.copytree(whole, tmp_path / "out"))
        unseen = number % 2
        if unseen:
            hide_from_the_clock(out)
        path = chance.choice(damaged_files(out))
        damage = DAMAGES[number % len(DAMAGES)]
        path.write_bytes(damage(path.read_bytes(), chance))
        name = str(path.relative_to(out))
        if unseen and not name.startswith("pack"):
            shutil.rmtree(out / "pack")  # so that everything before it is read again
        became = what_follows(again, out, wanted, f"damage {number}: {damage.__name__} {name}, unseen: {unseen}")
        seen[became] += 1
        shutil.rmtree(out)
    faults["damages of a run"] += count
    assert seen["refused"] < count / 2, "most damages are repaired by the same commands"
