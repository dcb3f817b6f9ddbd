"""A run that is really killed in the middle, alone and as two processes of torchrun, and the same command again."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from wsm_data.files.digest import sha256_file
from wsm_model.training.checkpoint import checkpoints

pytestmark = pytest.mark.slow

STEPS, KILLED_AFTER = 20, 10
LIMIT_S = 300
SETTINGS = (
    "order.global_batch=2",
    f"training.max_steps={STEPS}",
    "training.precision=float32",
    f"training.checkpoint_every={KILLED_AFTER}",
    "held_out.clips=0",
)
TORCHRUN = ("-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2")


@pytest.fixture(params=[(), TORCHRUN], ids=["alone", "torchrun of 2"])
def start(request, tiny) -> Callable[[Path], subprocess.Popen[str]]:
    """Starts `wsm train` into a folder."""

    def run(out: Path) -> subprocess.Popen[str]:
        words = ["-m", "pipelines.cli", "train", str(tiny.folder), "--out", str(out), "--quiet"]
        for assignment in SETTINGS:
            words += ["-s", assignment]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        return subprocess.Popen(
            [sys.executable, *request.param, *words], env=environment, text=True, stderr=subprocess.PIPE
        )

    return run


def finish(process: subprocess.Popen[str]) -> None:
    """Wait for a run's good end."""
    _, said = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, said


def kill_after_checkpoint(process: subprocess.Popen[str], out: Path) -> None:
    """Kill a run as soon as its first checkpoint is whole; torchrun takes its workers with it at SIGTERM alone."""
    until_s = time.monotonic() + LIMIT_S
    while not checkpoints(out / "checkpoints"):
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < until_s, "no checkpoint was written"
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM if "torch.distributed.run" in process.args else signal.SIGKILL)
    process.communicate(timeout=LIMIT_S)


def losses(out: Path) -> list[dict[str, float]]:
    """Lines of metrics without the time they took."""
    lines = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    return [{name: value for name, value in line.items() if name != "seconds"} for line in lines]


def test_ten_steps_a_kill_and_ten_more_are_twenty_steps_to_the_bit(start, tmp_path):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    finish(start(whole))
    killed = start(cut)
    try:
        kill_after_checkpoint(killed, cut)
    finally:
        killed.kill()
    assert not (cut / "model").exists()  # it was the middle
    assert [path.name for path in checkpoints(cut / "checkpoints")] == [f"step-{KILLED_AFTER:06d}"]
    finish(start(cut))
    assert sha256_file(cut / "model" / "model.safetensors") == sha256_file(whole / "model" / "model.safetensors")
    assert losses(cut) == losses(whole)
    assert [line["step"] for line in losses(cut)] == list(range(1, STEPS + 1))
