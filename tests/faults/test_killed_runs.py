"""Runs of a stage that are killed, anywhere: the resumed folder is the one an undisturbed run leaves."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import count

import pytest
from fake_stages import COPY, CopyConfig

from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.running.upstream import require_stage
from wsm_data.errors import ConfigError

OPTIONS = RunOptions(quiet=True, max_refused=100)
DOES_NOT_COUNT = {"time", "seconds", "workers", "xxh3", "quarantine.jsonl"}
"""What two undisturbed runs do not agree on either: times, and checksums of a line and of a file with times."""


def without_times(value):
    if isinstance(value, dict):
        return {key: without_times(item) for key, item in value.items() if key not in {*DOES_NOT_COUNT, "pid"}}
    return [without_times(item) for item in value] if isinstance(value, list) else value


def state(folder):
    """Every file of a folder by name: outputs to the byte, records without times, the ledger sorted by unit."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        if path.suffix == ".jsonl":
            lines = [without_times(json.loads(line)) for line in path.read_text().splitlines()]
            found[path.name] = sorted(lines, key=lambda line: line["unit"])
        elif path.name == "stage.json":
            found[path.name] = without_times(json.loads(path.read_text()))
        else:
            found[str(path.relative_to(folder))] = path.read_bytes()
    return found


def without_temporaries(found):
    return {name: content for name, content in found.items() if not name.endswith(".partial")}


class Deaths:
    """Kills this process just before its n-th step towards the disk."""

    def __init__(self, at):
        self.left = at

    def before(self, function):
        def step(*args, **kwargs):
            self.left -= 1
            if self.left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return function(*args, **kwargs)

        return step

    def install(self):
        from wsm_data.files import jsonlines

        jsonlines.canonical_json = self.before(jsonlines.canonical_json)  # before a ledger line is written
        for name in ("fsync", "replace", "unlink"):
            setattr(os, name, self.before(getattr(os, name)))


def run_and_die(config, out, at):
    """Exit code of a run in a process of its own that dies at its `at`-th step; 0 when it came to its end before."""
    child = os.fork()
    if child == 0:
        Deaths(at).install()
        try:
            run_stage(COPY, config, out, OPTIONS)
        finally:
            os._exit(0 if sys.exc_info()[0] is None else 3)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@pytest.fixture
def before(config, tmp_path):
    """A finished folder; after it was written one unit changed, one left, and two came, one of them bad."""
    folder = tmp_path / "before"
    run_stage(COPY, config, folder, OPTIONS)
    (config.source / "a1.txt").write_text("changed")
    (config.source / "b1.txt").unlink()
    (config.source / "c1.txt").write_text("new")
    (config.source / "d1.txt").write_text("bad")
    return folder


def test_killed_before_any_step_to_the_disk_a_run_resumes_to_the_same_state(config, before, tmp_path, faults):
    undisturbed = tmp_path / "undisturbed"
    shutil.copytree(before, undisturbed)
    run_stage(COPY, config, undisturbed, OPTIONS)
    whole, old = state(undisturbed), state(before)
    assert {line["unit"] for line in whole["ledger.jsonl"]} == {"a1", "a2", "c1", "d1"}
    for at in count(1):
        out = tmp_path / "killed"
        shutil.copytree(before, out)
        code = run_and_die(config, out, at)
        left = without_temporaries(state(out))
        try:
            require_stage(out, "copy")  # whoever comes after is told that this is unfinished, unless it is whole
        except ConfigError:
            pass
        else:
            assert left in (whole, old), f"step {at}"
        run_stage(COPY, config, out, OPTIONS)
        assert state(out) == whole, f"step {at}"
        shutil.rmtree(out)
        if code == 0:
            break
        assert code == -signal.SIGKILL
        faults["kills of runs"] += 1
    assert at > 30  # the steps of three units, of finish, and of the four records


def test_killed_after_every_unit_in_turn_no_unit_is_done_that_was_done(config, tmp_path):
    """A run that is allowed one unit and then dies: each resumed run begins where the last one ended."""
    (config.source / "b2.txt").write_text("b2")
    out = tmp_path / "out"
    for done in range(1, 5):
        run_stage(COPY, config, out, replace(OPTIONS, limit=1))
        lines = (out / "ledger.jsonl").read_text().splitlines()
        assert len(lines) == done
    units = [line for line in (tmp_path / "calls.txt").read_text().splitlines() if line != "finish"]
    assert units == ["a1", "a2", "b1", "b2"]


PROGRAM = """
import sys
from pathlib import Path
from fake_stages import COPY, CopyConfig
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
if __name__ == "__main__":
    source, out, workers = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    run_stage(COPY, CopyConfig(source=source, pause_s=0.03), out, RunOptions(quiet=True, workers=workers))
"""


def lines_in(folder):
    return sum(path.read_bytes().count(b"\n") for path in folder.glob("ledger*.jsonl"))


@pytest.mark.parametrize(
    ("workers", "kills"), [(1, 3), (2, 3), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((1, 40), (2, 40)))]
)
def test_killed_at_random_moments_a_run_still_ends_as_undisturbed(
    tmp_path, source, fakes_on_path, workers, kills, faults
):
    out, undisturbed = tmp_path / "out", tmp_path / "undisturbed"
    units = max(16, kills + 8)
    for number in range(units - 3):  # and the three of the fixture
        (source / f"u{number:02d}.txt").write_text(f"text {number}")
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    moments = random.Random(workers)
    for number in range(kills):
        reached = 1 + number * (units - 5) // kills
        command = [sys.executable, program, source, out, str(workers)]
        with subprocess.Popen(command, env=fakes_on_path, start_new_session=True) as child:
            while lines_in(out) < reached:
                assert child.poll() is None
                time.sleep(0.005)
            time.sleep(moments.uniform(0, 0.06))
            child.kill()
        faults["kills of runs"] += 1
    run_stage(COPY, CopyConfig(source=source), out, replace(OPTIONS, workers=workers))
    run_stage(COPY, CopyConfig(source=source), undisturbed, OPTIONS)
    # a worker outlives its killed driver by the unit it is at: what it writes then has the same bytes
    resumed, whole = without_temporaries(state(out)), state(undisturbed)
    assert {name: resumed[name] for name in resumed if name != "stage.json"} == {
        name: whole[name] for name in whole if name != "stage.json"
    }
    assert resumed["stage.json"]["finished"] == whole["stage.json"]["finished"]
    assert len({line["unit"] for line in resumed["ledger.jsonl"]}) == len(resumed["ledger.jsonl"]) == units
