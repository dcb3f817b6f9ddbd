"""Plants every kind of fault through its test; if all hold, writes what happens into docs/reliability.md.

Usage: python tests/faults/table.py
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENT = ROOT / "docs" / "reliability.md"
BEGIN, END = "<!-- written by tests/faults/table.py -->", "<!-- end -->"

KINDS = (
    ("killed between any two steps to the disk", "goes on to the same bytes", "tests/faults/test_killed_runs.py"),
    ("full disk, dead worker, Ctrl-C in a stage", "one sentence; goes on", "tests/faults/test_interrupted_runs.py"),
    (
        "worker killed or hanging (`--unit-timeout`), memory eaten, clock an hour off",
        "done again by another worker, or one sentence; the same bytes",
        "tests/faults/test_mishaps_of_workers.py",
    ),
    ("ranks of a training killed", "no clip lost or seen twice", "tests/faults/test_killed_training.py"),
    (
        "file of a run flipped, cut or swapped",
        "made again, or refused with exit code 4",
        "tests/faults/test_damages.py",
    ),
    (
        "pipes, devices, sizes and numbers without measure, names that climb, in a source",
        "one line of the quarantine; the rest is read",
        "tests/faults/test_hostile_inputs.py",
    ),
    (
        "scores or a selection in a release flipped or cut",
        "found by `wsm verify`, or nothing that is read changes",
        "tests/wsm_data/curation/test_attached.py",
    ),
    ("checkpoint damaged", "refused; never trained on", "tests/faults/test_damaged_checkpoints.py"),
    (
        "output of a stage damaged, same size",
        "set aside and made again by the same command",
        "tests/pipelines/running/test_upstream.py",
    ),
    (
        "Ctrl-C or SIGTERM where Python swallows it",
        "arrives; exit code 130 or 143",
        "tests/pipelines/running/test_interrupts.py",
    ),
    (
        "SIGTERM to `wsm train`",
        "saves the step it is at; exit code 143",
        "tests/wsm_model/training/test_loop.py",
    ),
    (
        "Ctrl-C or full disk while a checkpoint is saved",
        "one sentence; no half checkpoint",
        "tests/wsm_model/training/test_checkpoint.py",
    ),
    ("disk full, in any command", "one sentence; goes on", "tests/pipelines/running/disk/test_full_disk.py"),
    (
        "folder of the source or of the run deleted while a stage works",
        "one sentence that names it; goes on",
        "tests/pipelines/running/disk/test_gone_folder.py",
    ),
    (
        "nothing writable but `--out`",
        "kernels are kept in a temporary folder",
        "tests/wsm_data/files/test_kernel_cache.py",
    ),
    (
        "release on a read-only disk",
        "said before the work; the result stays in `--out`",
        "tests/pipelines/artifacts/test_release_files.py",
    ),
    (
        "URL where a folder is needed",
        "refused before any work; exit code 2",
        "tests/wsm_data/files/test_locations.py",
    ),
    ("packages installed that are not asked for", "never imported", "tests/wsm_data/loaders/test_loader_imports.py"),
)
"""Kind of fault, what happens, and the test that plants it."""


def table() -> str:
    """The kinds as a table in markdown."""
    rows = [f"| {kind} | {happens} | `{test}` |" for kind, happens, test in KINDS]
    return "\n".join(["| fault | what happens | planted by |", "|---|---|---|", *rows])


def main() -> int:
    """Write the table if every test of it passes; name those that do not."""
    failed = []
    for _, _, test in KINDS:
        done = subprocess.run([sys.executable, "-m", "pytest", "-q", test], cwd=ROOT, capture_output=True, text=True)
        failed += [test] if done.returncode else []
        sys.stdout.write(f"{test}: {'does not hold' if done.returncode else 'holds'}\n")
    if failed:
        return 1
    before, _, rest = DOCUMENT.read_text().partition(BEGIN)
    DOCUMENT.write_text(f"{before}{BEGIN}\n{table()}\n{END}{rest.partition(END)[2]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
