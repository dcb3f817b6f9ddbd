"""A limit on how long talking over a socket may take in all; a socket's own limit begins anew with every byte."""

import socket
import threading
from contextlib import suppress
from types import TracebackType


class TimeLimit:
    """Shuts a socket down, as far as `how` says, when the time is over: who waits for it then sees its end.

    Args:
        seconds: from entering on.
        how: `socket.SHUT_RD` to leave the way open for an answer, `socket.SHUT_RDWR` for both directions.
    """

    def __init__(self, sock: socket.socket, seconds: float, how: int):
        self.is_over = False
        self._socket = sock
        self._how = how
        self._timer = threading.Timer(seconds, self._end)
        self._timer.daemon = True

    def __enter__(self) -> "TimeLimit":
        self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._timer.cancel()

    def _end(self) -> None:
        self.is_over = True
        with suppress(OSError):  # the other side may have closed it by now
            self._socket.shutdown(self._how)
