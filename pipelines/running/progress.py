"""What is told while a stage works: a bar on a terminal, a line a unit anywhere else."""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count

from tqdm import tqdm

from pipelines.running.options import RunOptions
from pipelines.running.stage import REFUSED, Outcome

_LOG = logging.getLogger(__name__)


@contextmanager
def progress(stage: str, total: int, options: RunOptions) -> Iterator[Callable[[Outcome], None]]:
    """Yields what is called with each outcome; `pipelines.running.logs` decides who reads the lines."""
    hidden = options.quiet or not total or in_lines(options)
    numbers = count(1)
    with tqdm(total=total, desc=stage, unit="unit", disable=hidden, dynamic_ncols=True) as bar:

        def tell(outcome: Outcome) -> None:
            _LOG.info("%s %d/%d %s", stage, next(numbers), total, _line(outcome))
            bar.update()

        yield tell


def in_lines(options: RunOptions) -> bool:
    """Whether units are told of in lines: a file keeps every carriage return of a bar."""
    return options.verbose or not sys.stderr.isatty()


def _line(outcome: Outcome) -> str:
    line = f"{outcome.unit} {outcome.state} {outcome.seconds:.2f} s"
    if outcome.state == REFUSED:
        return f"{line} {outcome.refusals[0].reason}: {outcome.refusals[0].message}"
    return f"{line}, {len(outcome.refusals)} parts refused" if outcome.refusals else line
