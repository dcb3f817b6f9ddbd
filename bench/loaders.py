"""Batches of clips: this project's loader against four libraries, and against the machine.

All deliver the same 300 clips of 2 MB, as they are stored, in batches of 8: colour latents, depth latents, valid shares
and poses, stacked. Every contestant has them in its own format, in the page cache, and runs in a process of its own, in
an environment of its own where it needs one. One works at a time, all take turns within a round, and a ratio is taken
within a round. The contestants and their settings are the modules of loader_peers. Run as `python bench/loaders.py`:
environments and clips (4 GB) are made on first use, in a folder that git ignores.
"""

import argparse
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from loader_peers.arrays import BATCH, CLIP_BYTES, CLIPS
from loader_peers.contest import Contest
from loader_peers.entries import ENTRIES, LIMITS, RESUMED, takes_part
from loader_peers.environments import PACKAGES
from loader_peers.page import page
from reporting import machine, write_results

CACHE = Path(__file__).parents[1] / "runs" / "bench_loaders"
ROUNDS = 5
COMPARISONS = {
    "in one process": {"shuffle": False, "processes": False},
    "in one process, shuffled": {"shuffle": True, "processes": False},
    "DataLoader with 2 workers": {"shuffle": False, "processes": True},
    "DataLoader with 2 workers, shuffled": {"shuffle": True, "processes": True},
}
STEPS_BEFORE_RESUMING = CLIPS // BATCH // 2


def compare(contest: Contest, names: list[str], rounds: int, **kind: bool) -> dict[str, list[float]]:
    """Clips per second of entries, by round. Before it, every array of every clip is compared with what was stored."""
    for name in names:
        contest.running(name).ask("open", **contest.setting(name, **kind))
        if ENTRIES[name].as_stored:
            found = contest.running(name).ask("check", digests=contest.digests)
            require(name, found, {"wrong": 0, "twice": 0, "missing": 0})
        contest.running(name).ask("round")
    rates: dict[str, list[float]] = {name: [] for name in names}
    for turn in range(rounds):
        first = turn % len(names)
        for name in names[first:] + names[:first]:
            found = contest.running(name).ask("round")
            as_stored = ENTRIES[name].as_stored or name in LIMITS
            clips = found["epochs"] * CLIPS
            require(name, found, {"clips": clips} | ({"bytes": clips * CLIP_BYTES} if as_stored else {}))
            rates[name].append(clips / found["seconds"])
    return rates


def require(name: str, found: dict[str, Any], expected: dict[str, int]) -> None:
    if {key: found[key] for key in expected} != expected:
        raise ValueError(f"{name} must deliver {expected}, found {found}")


def first_batches(
    contest: Contest, rounds: int, folder: str
) -> tuple[dict[str, list[float]], dict[str, dict[str, Any]]]:
    """Seconds from the imports to the first batch, shuffled: of an epoch, and of what is left of one in its middle.

    Both in turn, each in a process of its own; and what came after the place that was resumed from.
    """
    fresh: dict[str, list[float]] = {name: [] for name in RESUMED}
    results: dict[str, dict[str, Any]] = {}
    settings = {name: contest.setting(name, shuffle=True, processes=False) for name in RESUMED}
    for name, setting in settings.items():
        with contest.fresh(name) as child:
            child.ask("open", **setting)
            left = child.ask("leave", steps=STEPS_BEFORE_RESUMING, state=f"{folder}/{name}")
        results[name] = {"seconds": [], "left": left}
    for _ in range(rounds):
        for name, result in results.items():
            with contest.fresh(name) as child:
                fresh[name].append(child.ask("first", **settings[name])["seconds"])
            with contest.fresh(name) as child:
                answer = child.ask("resume", state=f"{folder}/{name}", **settings[name])
            result["seconds"].append(answer["seconds"])
            result["continued"] = continued(**result["left"], found=answer["rest"])
    for result in results.values():
        del result["left"]
    return fresh, results


def continued(delivered: list[int], rest: list[int], found: list[int]) -> dict[str, object]:
    """Whether a resumed epoch brought what was left of it, in order; otherwise how many clips were lost or repeated."""
    return {
        "exact": found == rest,
        "lost": len(set(rest) - set(found)),
        "repeated": len(set(delivered) & set(found)) + len(found) - len(set(found)),
    }


def run(cache: Path, rounds: int) -> dict[str, Any]:
    with ExitStack() as processes, tempfile.TemporaryDirectory() as folder:
        contest = Contest(cache, processes)
        rates, memory = {}, {}
        for comparison, kind in COMPARISONS.items():
            print(comparison, file=sys.stderr)
            names = [name for name in ENTRIES if takes_part(name, **kind)]
            rates[comparison] = compare(contest, names, rounds, **kind)
            if not memory:  # after the first comparison, in one process
                memory = {name: contest.running(name).ask("memory") for name in names if name not in LIMITS}
        processes.close()
        print("first batches", file=sys.stderr)
        first, resumed = first_batches(contest, rounds, folder)
        return {"clips_per_s": rates, "memory_mb": memory, "first_batch_s": first, "resumed": resumed}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, default=CACHE, help="folder of environments and clips")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    arguments = parser.parse_args()
    setup = machine("torch", "numpy", "webdataset", "pyarrow", "xxhash")
    setup |= dict(packages[0].split("==") for packages in PACKAGES.values())
    results = run(arguments.cache.resolve(), arguments.rounds)
    record = {"machine": setup, "clips": CLIPS, "clip_bytes": CLIP_BYTES, "batch_clips": BATCH}
    record |= {"steps_before_resuming": STEPS_BEFORE_RESUMING, **results}
    write_results("loaders", record, page(record))


if __name__ == "__main__":
    main()
