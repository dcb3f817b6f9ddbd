"""Who reads what a run logs: standard error, and a file where one was asked for."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from pipelines.running import progress
from pipelines.running.options import StageRequest
from wsm_data.errors import ConfigError, WsmError

_LOG = logging.getLogger(__name__)
_FILE_ONLY = "file_only"
_FORMAT = "%(asctime)s %(levelname)s %(message)s"


@contextmanager
def logged(request: StageRequest) -> Iterator[None]:
    """Have lines, warnings and errors arrive where the request wants them, while the body runs.

    Raises:
        ConfigError: the log file cannot be written.
    """
    handlers = [_on_standard_error(request)] + ([_in_file(request)] if request.log_file else [])
    root = logging.getLogger()
    level, before = root.level, list(root.handlers)
    root.handlers = list(handlers)
    root.setLevel(logging.INFO)
    try:
        yield
    except WsmError as error:  # it is told on standard error by whoever ends the program
        _LOG.error("%s", error, extra={_FILE_ONLY: True})
        raise
    finally:
        root.handlers = before
        root.setLevel(level)
        for handler in handlers:
            handler.close()


def log_table(text: str) -> None:
    """Keep in the log file what is printed on standard output."""
    _LOG.info("%s", text, extra={_FILE_ONLY: True})


def _on_standard_error(request: StageRequest) -> logging.Handler:
    handler = logging.StreamHandler()
    options = request.options
    with_lines = progress.in_lines(options) and not options.quiet

    def is_told(record: logging.LogRecord) -> bool:
        if getattr(record, _FILE_ONLY, False):
            return False
        if record.name == progress.__name__:
            return with_lines
        return options.verbose or record.levelno >= logging.WARNING

    handler.addFilter(is_told)
    handler.setFormatter(logging.Formatter("%(levelname)s %(message)s"))
    return handler


def _in_file(request: StageRequest) -> logging.Handler:
    try:
        handler = logging.FileHandler(str(request.log_file), encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise ConfigError(f"--log-file must be a file that can be written ({error})") from error
    handler.setFormatter(logging.Formatter(_FORMAT))
    return handler
