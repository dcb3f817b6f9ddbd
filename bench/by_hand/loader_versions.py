"""The loader of two checkouts of the project on the same clips, in turn: what a change of it costs or gains.

Run by hand: `git worktree add ../before COMMIT`, then
`PYTHONPATH=bench python bench/by_hand/loader_versions.py ../before .`. Each checkout has a process of its own. Both
read one release, which the first writes; rounds alternate, and who begins changes with each. Clips a second of
processor time, all threads of the process together, are what tells on a machine that has other work too.
"""

import argparse
import statistics
import sys
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from loader_peers.processes import Child
from reporting import machine, machine_line, table

SETTINGS = {
    "stored order": {},
    "shuffled": {"shuffle": True},
    "one thread": {"options": {"threads": 1}},
    "checksums always": {"options": {"verify": "always"}},
    "checksums never": {"options": {"verify": "never"}},
    "standardised float32": {"options": {"standardise": True, "dtype": "float32"}},
}
NAMES = ("before", "after")


def round_of(child: Child) -> tuple[float, float]:
    """Clips a second, and clips a second of processor time."""
    begun_s = child.cpu_s
    found = child.ask("round")
    return found["clips"] / found["seconds"], found["clips"] / (child.cpu_s - begun_s)


def compared(children: Mapping[str, Child], folder: Path, setting: Mapping[str, object], rounds: int) -> list[str]:
    """Medians of both, and the median ratio with its range, of time and of processor time."""
    for child in children.values():
        child.ask("open", **{"folder": str(folder), "shuffle": False, "workers": 0, "options": {}, **setting})
        child.ask("round")  # files come into memory, and clips are checked for the first time
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in NAMES}
    for number in range(rounds):
        for name in NAMES if number % 2 else NAMES[::-1]:
            found[name].append(round_of(children[name]))
    medians = [f"{statistics.median(rate for rate, _ in found[name]):.0f}" for name in NAMES]
    pairs = list(zip(found["before"], found["after"], strict=True))
    ratios = [sorted(after[what] / before[what] for before, after in pairs) for what in (0, 1)]
    return [*medians, *(f"{statistics.median(one):.3f} ({one[0]:.2f} to {one[-1]:.2f})" for one in ratios)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path, help="a checkout")
    parser.add_argument("after", type=Path, help="another one")
    parser.add_argument("--rounds", type=int, default=15, help="rounds of each, a second long")
    given = parser.parse_args()
    python, folders = Path(sys.executable), (given.before, given.after)
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as processes:
        children = {
            name: processes.enter_context(Child(python, "with_wsm", folder.resolve() / "bench"))
            for name, folder in zip(NAMES, folders, strict=True)
        }
        release = Path(scratch) / "release"
        children["before"].ask("write", folder=str(release))
        rows = [[name, *compared(children, release, one, given.rounds)] for name, one in SETTINGS.items()]
    header = ["setting", "before, clips/s", "after, clips/s", "after / before", "per processor second"]
    print("\n".join([*table(header, rows), "", machine_line(machine("numpy", "torch", "xxhash"))]))


if __name__ == "__main__":
    main()
