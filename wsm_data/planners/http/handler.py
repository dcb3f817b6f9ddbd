"""One request over one connection: read it within its limits, let the service answer, count what became of it."""

import json
import socket
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from types import MappingProxyType
from typing import TYPE_CHECKING

from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.form import read_form
from wsm_data.planners.http.time_limit import TimeLimit
from wsm_data.planners.http.wire import read_object

if TYPE_CHECKING:
    from wsm_data.planners.http.server import PlannerServer

_STATUS: Mapping[Fault, HTTPStatus] = MappingProxyType(
    {
        Fault.LATE: HTTPStatus.REQUEST_TIMEOUT,
        Fault.TOO_LARGE: HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
        Fault.OUT_OF_TURN: HTTPStatus.CONFLICT,
        Fault.UNSUPPORTED: HTTPStatus.NOT_IMPLEMENTED,
        Fault.PLANNER: HTTPStatus.INTERNAL_SERVER_ERROR,
    }
)
"""Of all other faults it is 400."""

_OTHER_GOALS = ("/nogoal_step", "/imagegoal_step", "/pixelgoal_step", "/navdp_step_ip_mixgoal")


class RequestHandler(BaseHTTPRequestHandler):
    """Answers one request and closes the connection."""

    server: "PlannerServer"
    server_version = "wsm"
    sys_version = ""

    def setup(self) -> None:
        """Start the clock of the request."""
        super().setup()
        self._limit = TimeLimit(self.connection, self.server.config.request_timeout_s, socket.SHUT_RD)
        self._limit.__enter__()

    def finish(self) -> None:
        """Stop the clock."""
        self._limit.__exit__(None, None, None)
        super().finish()

    def do_GET(self) -> None:
        """The health page."""
        if self.path == "/health":
            self._send(HTTPStatus.OK, json.dumps(self.server.health()).encode())
            return
        self._send(HTTPStatus.NOT_FOUND, _error("there is /health, and the planner's own pages are posted to"))

    def do_POST(self) -> None:
        """The pages of the protocol; whatever goes wrong is answered with an `error`, and counted."""
        try:
            answer = self._answer(self._body())
        except WireError as error:
            self.server.count_fault(error.fault, f"{self.path}: {error}")
            self._send(_STATUS.get(error.fault, HTTPStatus.BAD_REQUEST), _error(str(error)))
            return
        self.server.count_answer(self.path)
        self._send(HTTPStatus.OK, answer)

    def _answer(self, body: bytes) -> bytes:
        service = self.server.service
        if self.path == "/pointgoal_step":
            form = read_form(self.headers.get("Content-Type", ""), body)
            with self.server.turn:
                return service.point_goal_step(form)
        if self.path in _OTHER_GOALS:
            raise WireError(
                Fault.UNSUPPORTED, f"the planner {service.planner.name} drives to points; only /pointgoal_step is"
            )
        answers = {"/navigator_reset": service.reset, "/navigator_reset_env": service.reset_environment}
        if self.path not in answers:
            raise WireError(Fault.UNSUPPORTED, f"there is no page {self.path[:80]!r}")
        record = read_object(body, "the request")
        with self.server.turn:
            return answers[self.path](record)

    def _body(self) -> bytes:
        """The body, whole.

        Raises:
            WireError: `malformed` without a length, `too_large`, `late`, or `cut_off`.
        """
        text = self.headers.get("Content-Length", "")
        if not text.isascii() or not text.isdigit() or "Transfer-Encoding" in self.headers:
            raise WireError(Fault.MALFORMED, f"a request must say its Content-Length, found {text[:40]!r}")
        length, most = int(text[:20]), self.server.config.max_request_bytes
        if length > most:
            raise WireError(Fault.TOO_LARGE, f"a request must have at most {most} bytes, found {length}")
        body = self._read(length)
        if self._limit.is_over:
            raise WireError(Fault.LATE, f"a request must come whole in {self.server.config.request_timeout_s} s")
        if len(body) < length:
            raise WireError(Fault.CUT_OFF, f"a request of {length} bytes ended after {len(body)}")
        return body

    def _read(self, length: int) -> bytes:
        try:
            return self.rfile.read(length)
        except ConnectionError as error:
            raise WireError(Fault.CUT_OFF, f"the client went away in the middle of a request: {error}") from error

    def _send(self, status: HTTPStatus, body: bytes) -> None:
        """Send an answer; a client that does not take it in time, or is gone, is counted."""
        with TimeLimit(self.connection, self.server.config.request_timeout_s, socket.SHUT_RDWR):
            try:
                self.send_response(status)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)
            except OSError as error:
                self.server.count_fault(Fault.CUT_OFF, f"{self.path}: the client did not take its answer: {error}")

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Nothing: requests are counted, and faults are logged where they are counted."""


def _error(message: str) -> bytes:
    return json.dumps({"error": message}).encode()
