"""A trace of some steps: which kernels and which waits take the time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import torch
from torch.profiler import ProfilerActivity, profile, schedule

from wsm_data.files.atomic import write_text

WARM_UP_STEPS = 3
"""Steps that go by first: compilation, caches, the first batches."""
TRACE, TABLE = "trace.json", "operations.txt"
_ROWS = 40


@contextmanager
def profiled(folder: Path, steps: int) -> Iterator[Callable[[], None]]:
    """Record some steps, after a few that are not, and write what was seen.

    Args:
        folder: takes `trace.json`, which Perfetto and chrome://tracing show, and `operations.txt`, the operations that
            took most of the time.
        steps: that are recorded; 0: none, and nothing is written.

    Yields:
        What is to be called after every step.
    """
    if not steps:
        yield lambda: None
        return
    activities = [ProfilerActivity.CPU] + ([ProfilerActivity.CUDA] if torch.cuda.is_available() else [])

    def write(found: profile) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        found.export_chrome_trace(str(folder / TRACE))
        key = "self_cuda_time_total" if torch.cuda.is_available() else "self_cpu_time_total"
        write_text(folder / TABLE, found.key_averages().table(sort_by=key, row_limit=_ROWS) + "\n")

    plan = schedule(wait=WARM_UP_STEPS - 1, warmup=1, active=steps, repeat=1)
    with profile(activities=activities, schedule=plan, on_trace_ready=write) as running:
        yield running.step
