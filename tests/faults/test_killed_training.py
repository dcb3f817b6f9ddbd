"""Ranks of a training run are killed and resumed, also on another number of ranks; the ledger proves what was seen."""

import json
import os
import secrets
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipelines.operations.audit_run import audit_run
from wsm_data.errors import IntegrityError
from wsm_data.loaders.ledger.audit import audit_epochs
from wsm_data.loaders.ledger.sources import open_recorded_sources
from wsm_data.loaders.ledger.timeline import read_timeline

PROGRAM = Path(__file__).parent / "fakes" / "train_rank.py"
CLIPS, STEPS = 39, 10  # in steps of four, the last one with a repeated clip


@pytest.fixture
def run(tmp_path, tiny, make_clip):
    """Settings that all ranks share."""
    clips = [make_clip(f"synth_d435i/home_{number % 5:04d}/{number:06d}", latents=2) for number in range(CLIPS)]
    tiny.pack(tmp_path / "many", clips, shard_bytes=250_000)
    return {
        "release": str(tmp_path / "many"),
        "ledger": str(tmp_path / "ledger"),
        "checkpoint": str(tmp_path / "checkpoint.json"),
        "epochs": 2,
        "checkpoint_every": 3,
        "killed_before_the_step": True,
    }


@pytest.fixture(scope="module")
def server():
    """Starts ranks without importing torch for each anew."""
    command = [sys.executable, str(PROGRAM)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True, text=True
    ) as process:
        yield process
        os.killpg(process.pid, signal.SIGKILL)


@pytest.fixture
def session(run, server, tmp_path):
    """Runs all ranks at once, each slower than the one before, one of them perhaps to a sudden end."""

    def start(world_size, *, victim=-1, killed_at=None, **changes):
        group = str(tmp_path / secrets.token_hex(8))
        ranks = [run | changes | {"group": group, "rank": rank, "world_size": world_size} for rank in range(world_size)]
        for rank, settings in enumerate(ranks):
            settings |= {"pause_s": 0.01 * rank, "killed_at": killed_at if rank == victim else None}
        server.stdin.write(json.dumps(ranks) + "\n")
        server.stdin.flush()
        codes = json.loads(server.stdout.readline())
        assert codes[victim] == -signal.SIGKILL or killed_at is None
        assert killed_at is None or all(code != 0 for code in codes), "no rank may go on without the others"
        assert killed_at is not None or codes == [0] * world_size

    return start


def prove(run):
    timeline = read_timeline(Path(run["ledger"]))
    audits = audit_epochs(timeline, open_recorded_sources(timeline.identity, [run["release"]], []))
    assert timeline.misfits == ()
    assert [audit.misfits for audit in audits] == [()] * len(audits)
    return timeline, audits


def test_killed_ranks_are_resumed_on_any_world_size_and_nothing_is_lost_or_seen_twice(run, session, capsys):
    session(2, victim=1, killed_at=[0, 7])
    session(2, victim=0, killed_at=[1, 4], killed_before_the_step=False)
    session(4, victim=3, killed_at=[1, 8])
    session(1)
    timeline, audits = prove(run)
    assert sorted({file.world_size for file in timeline.files}) == [1, 2, 4]
    assert [(audit.complete, audit.seen_once, audit.seen_more, audit.never) for audit in audits] == [
        (True, CLIPS - 1, 1, 0)
    ] * 2
    # checkpoints every third step: 7 steps and an unfinished one went to 6, steps 3 and 4 of the second epoch to 3, ...
    assert [(again.epoch, again.start, again.end) for again in timeline.again] == [(0, 6, 8), (1, 3, 5), (1, 6, 9)]
    audit_run(Path(run["ledger"]), [run["release"]], [], None, None, None)
    assert capsys.readouterr().out.splitlines()[-1].startswith("2 of 2 epochs complete, no step missing, none twice")


def test_a_resume_from_beyond_what_was_trained_is_found_out(run, session):
    session(1, victim=0, killed_at=[0, 4])
    checkpoint = Path(run["checkpoint"])
    state = json.loads(checkpoint.read_text())
    checkpoint.write_text(json.dumps(state | {"step": 7}))
    session(1)
    with pytest.raises(IntegrityError, match="epoch 0: steps 5 to 6 in no session"):
        audit_run(Path(run["ledger"]), [run["release"]], [], None, None, None)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_killed_twenty_times_a_run_has_seen_every_clip_as_if_undisturbed(run, session, faults):
    run |= {"epochs": 10}
    for kill in range(20):  # twice an epoch, before and after the step is recorded, alone and as one of two
        world_size = 1 + kill % 2
        before = kill % 3 == 0
        at = [kill // 2, 4 + 4 * (kill % 2)]
        session(world_size, victim=world_size - 1, killed_at=at, killed_before_the_step=before)
        faults["kills of trainings"] += 1
    session(1)
    _, audits = prove(run)
    assert [(audit.complete, audit.never) for audit in audits] == [(True, 0)] * 10
