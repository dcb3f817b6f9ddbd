"""Ranks of a training run: batches, a collective each step, a checkpoint by rank 0, and maybe a sudden end of one.

Each line of standard input is a JSON list of what each rank is to do. They are forked from this process, where all is
imported, and it answers with a list of their exit codes. A rank is told: release, ledger, checkpoint, group (file of
the process group), rank, world_size, epochs, pause_s (of each step), checkpoint_every (steps), killed_at ([epoch, step]
or null), killed_before_the_step.
"""

import json
import os
import signal
import sys
import time
from datetime import timedelta
from pathlib import Path

import torch
import torch.distributed

from wsm_data.files.atomic import write_text
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, Remainder, SourceConfig
from wsm_data.loaders.loader import ClipLoader


def config_of(settings):
    return LoaderConfig(
        sources=(SourceConfig(release=settings["release"], split=""),),
        order=OrderConfig(seed=5, global_batch=4, remainder=Remainder.REPEAT, block_clips=2),
        read=ReadConfig(threads=1, prefetch_batches=3),
        ledger=settings["ledger"],
    )


def train(settings):
    torch.set_num_threads(1)
    torch.distributed.init_process_group(
        "gloo",
        init_method=f"file://{settings['group']}",
        rank=settings["rank"],
        world_size=settings["world_size"],
        timeout=timedelta(seconds=30),
    )
    checkpoint = Path(settings["checkpoint"])
    with ClipLoader(config_of(settings)) as loader:
        if checkpoint.exists():
            loader.load_state_dict(json.loads(checkpoint.read_text()))
        while loader.state_dict()["epoch"] < settings["epochs"]:
            for batch in loader:
                step(settings, batch)
                state = loader.state_dict()
                if settings["rank"] == 0 and state["step"] % settings["checkpoint_every"] == 0:
                    write_text(checkpoint, json.dumps(state))
    torch.distributed.destroy_process_group()


def step(settings, batch):
    time.sleep(settings["pause_s"])
    dies = settings["killed_at"] == [batch.epoch, batch.step]
    if dies and settings["killed_before_the_step"]:
        os.kill(os.getpid(), signal.SIGKILL)
    clips = torch.tensor([len(batch.refs)])
    torch.distributed.all_reduce(clips)
    assert clips.item() == 4
    if dies:
        os.kill(os.getpid(), signal.SIGKILL)


def start(settings):
    """The process id of a rank."""
    child = os.fork()
    if not child:
        train(settings)
        sys.exit()
    return child


if __name__ == "__main__":
    for line in sys.stdin:
        ranks = [start(settings) for settings in json.loads(line)]
        codes = [os.waitstatus_to_exitcode(os.waitpid(rank, 0)[1]) for rank in ranks]
        sys.stdout.write(json.dumps(codes) + "\n")
        sys.stdout.flush()
