"""One contestant in a process of its own: a JSON object a line in, a JSON object a line out.

Run as `python -m loader_peers.worker with_litdata`. Whatever libraries print goes to standard error.
"""

import gc
import importlib
import json
import os
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import torch

from loader_peers import arrays
from loader_peers.contestant import Contestant, Loader, Setting

Reply = dict[str, object]

_ROUND_S = 1.0


class Process:
    """The contestant, and its opened loader if there is one. Every public method answers one request."""

    def __init__(self, contestant: Contestant):
        self._contestant = contestant
        self._loader: Loader | None = None
        self._before_kb = resident_kb()

    def write(self, folder: str) -> Reply:
        Path(folder).mkdir(parents=True)
        self._contestant.write(Path(folder))
        return {}

    def open(self, **setting: object) -> Reply:
        """Take a loader of this setting in place of the one before."""
        self._loader = None
        gc.collect()
        self._loader = self._contestant.open(_setting(setting))
        return {}

    def check(self, digests: dict[str, str]) -> Reply:
        """Deliver an epoch and compare every array of every clip."""
        seen: Counter[int] = Counter()
        wrong = 0
        for batch in self._loader.epoch():
            for number, digest in arrays.digests(batch).items():
                seen[number] += 1
                wrong += digests[str(number)] != digest
        twice = sum(count - 1 for count in seen.values())
        return {"wrong": wrong, "twice": twice, "missing": len(digests) - len(seen)}

    def round(self) -> Reply:
        """Deliver whole epochs, for a second at least, and take the time: one epoch is over in a tenth of that."""
        epochs = clips = size_bytes = 0
        start = time.perf_counter()
        while (seconds := time.perf_counter() - start) < _ROUND_S:
            epochs += 1
            for batch in self._loader.epoch():
                clips += len(next(iter(batch.values())))
                size_bytes += arrays.byte_count(batch)
        return {"seconds": seconds, "epochs": epochs, "clips": clips, "bytes": size_bytes}

    def memory(self) -> Reply:
        """Deliver an epoch and take the largest growth of resident memory since the imports, in MB."""
        peak = dict.fromkeys(self._before_kb, 0)
        for batch in self._loader.epoch():
            del batch
            peak = {name: max(peak[name], kb) for name, kb in resident_kb().items()}
        return {name: (kb - self._before_kb[name]) / 1024 for name, kb in peak.items()}

    def first(self, **setting: object) -> Reply:
        """Time from nothing but the imports to the first batch."""
        start = time.perf_counter()
        self._loader = self._contestant.open(_setting(setting))
        batches = iter(self._loader.epoch())  # held, so that ending it does not count
        batch = next(batches)
        return {"seconds": time.perf_counter() - start, "numbers": arrays.numbers(batch)}

    def leave(self, steps: int, state: str) -> Reply:
        """Deliver `steps` batches, save the state to a file, and go on to the end of the epoch."""
        batches = self._loader.epoch()
        delivered = [number for _ in range(steps) for number in arrays.numbers(next(batches))]
        torch.save(self._loader.state(), state)
        return {"delivered": delivered, "rest": [number for batch in batches for number in arrays.numbers(batch)]}

    def resume(self, state: str, **setting: object) -> Reply:
        """Time from nothing but the imports to the first batch after the state; then the rest of the epoch."""
        saved = torch.load(state, weights_only=False)  # of this run; Energon's is an object of its own
        start = time.perf_counter()
        self._loader = self._contestant.open(_setting(setting))
        self._loader.restore(saved)
        batches = iter(self._loader.epoch())
        batch = next(batches)
        seconds = time.perf_counter() - start
        return {
            "seconds": seconds,
            "rest": arrays.numbers(batch) + [number for batch in batches for number in arrays.numbers(batch)],
        }


def _setting(values: dict[str, object]) -> Setting:
    return Setting(**{**values, "folder": Path(values["folder"])})


def resident_kb() -> dict[str, int]:
    """Resident memory of this process: its own, pages of mapped files, and shared memory."""
    fields = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {name: int(fields[name].split()[0]) for name in ("RssAnon", "RssFile", "RssShmem")}


def main() -> None:
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    process = Process(importlib.import_module(f"loader_peers.{sys.argv[1]}").CONTESTANT)
    answers.write("{}\n")
    for line in sys.stdin:
        request = json.loads(line)
        answers.write(json.dumps(getattr(process, request.pop("do"))(**request)) + "\n")


if __name__ == "__main__":
    main()
