"""A planner behind the public HTTP protocol."""

import logging
import threading
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from http.server import ThreadingHTTPServer
from typing import Any

from wsm_data.planners.http.fault import Fault
from wsm_data.planners.http.handler import RequestHandler
from wsm_data.planners.http.service import PlannerService

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class ServerConfig:
    """Where a server listens, and its limits.

    Attributes:
        host: address it listens at; the default is reached from this machine alone.
        port: 0 for any that is free.
        request_timeout_s: a request must have come whole within this time, and its answer be taken.
        max_request_bytes: of a body.
        max_connections: at a time; more are closed at once.
    """

    host: str = "127.0.0.1"
    port: int = 19999
    request_timeout_s: float = 30.0
    max_request_bytes: int = 64 << 20
    max_connections: int = 64


class PlannerServer(ThreadingHTTPServer):
    """Serves until `shutdown`; closing it then waits for what is being answered.

    Args:
        service: answers one request at a time.
        config: limits.

    Raises:
        OSError: the address is taken, or not of this machine.
    """

    daemon_threads = False
    block_on_close = True
    request_queue_size = 64

    def __init__(self, service: PlannerService, config: ServerConfig):
        self.service = service
        self.config = config
        self.turn = threading.Lock()
        self._counting = threading.Lock()
        self._answered: Counter[str] = Counter()
        self._faults: Counter[str] = Counter()
        self._started_s = time.monotonic()
        self._room = threading.BoundedSemaphore(config.max_connections)
        super().__init__((config.host, config.port), RequestHandler)

    @property
    def url(self) -> str:
        """Where it is reached."""
        host, port = self.server_address[:2]
        return f"http://{host!s}:{port}"

    def health(self) -> Mapping[str, object]:
        """What the server has done so far; it does not wait for the planner."""
        with self._counting:
            return {
                "status": "ok",
                "algo": self.service.planner.name,
                "client": self.service.client.value,
                "environments": self.service.environments,
                "answered": dict(sorted(self._answered.items())),
                "faults": dict(sorted(self._faults.items())),
                "uptime_s": round(time.monotonic() - self._started_s, 3),
            }

    def count_answer(self, path: str) -> None:
        """Count a request that was answered as asked."""
        with self._counting:
            self._answered[path] += 1

    def count_fault(self, fault: Fault, message: str) -> None:
        """Count a request that was not, and log why."""
        with self._counting:
            self._faults[fault.value] += 1
        _LOG.warning("%s: %s", fault.value, message)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Give a connection a thread, while there is room."""
        if self._room.acquire(blocking=False):
            super().process_request(request, client_address)
            return
        self.count_fault(Fault.TOO_LARGE, f"more than {self.config.max_connections} connections at a time")
        self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve one connection to its end."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._room.release()

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ARG002
        """Log what no client is to blame for, with its traceback; the connection is closed."""
        _LOG.exception("a request from %s failed", client_address[0])
