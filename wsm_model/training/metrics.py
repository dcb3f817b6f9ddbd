"""What a run tells of itself: one JSON object per logged step, and the same numbers for TensorBoard."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from wsm_data.files.atomic import write_bytes
from wsm_data.files.jsonlines import canonical_json, line_appender, read_lines


class MetricsWriter(Protocol):
    """Takes the numbers of a step."""

    def __call__(self, step: int, values: Mapping[str, float]) -> None:
        """Write them."""


@contextmanager
def metrics_writer(folder: Path, done: int) -> Iterator[MetricsWriter]:
    """Open `metrics.jsonl` and the TensorBoard log of a run that has done `done` steps.

    Lines of later steps, which a killed run wrote after its last checkpoint, are taken out: those steps are done again.
    """
    path = folder / "metrics.jsonl"
    kept = [record for record in read_lines(path) if int(str(record["step"])) <= done]
    write_bytes(path, b"".join(canonical_json(record).encode() + b"\n" for record in kept))
    board = _board(folder, done)
    with line_appender(path) as append:
        try:

            def write(step: int, values: Mapping[str, float]) -> None:
                append({"step": step, **values})
                for name, value in values.items():
                    board.add_scalar(name, value, step)

            yield write
        finally:
            board.close()


def _board(folder: Path, done: int) -> Any:
    """The event writer; `purge_step` hides what a killed run wrote."""
    from torch.utils.tensorboard import SummaryWriter

    return SummaryWriter(str(folder / "tensorboard"), purge_step=done + 1)
