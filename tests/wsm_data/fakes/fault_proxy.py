"""An HTTP proxy in front of an object store, which spoils the answers it is told to spoil.

Faults are planned by method and path of the object: the next `times` requests whose method, path and query match get
the fault, all others pass unchanged. Everything that passed by is recorded.
"""

import http.client
import re
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

SLOW_DOWN = (
    b"<?xml version='1.0'?><Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"
)
DENIED = b"<?xml version='1.0'?><Error><Code>AccessDenied</Code><Message>Access Denied</Message></Error>"
NO_LISTING = (
    b"<?xml version='1.0'?><ListBucketResult xmlns='http://s3.amazonaws.com/doc/2006-03-01/'><IsTruncated>false"
    b"</IsTruncated><KeyCount>0</KeyCount></ListBucketResult>"
)
ANYBODY = "AWS4-HMAC-SHA256 Credential=test/20260101/us-east-1/s3/aws4_request, SignedHeaders=host, Signature=0"
"""Tells moto that S3 is meant, where a plain HTTP client asks."""
_UPSTREAM_TIMEOUT_S = 30.0


class Fault(StrEnum):
    SLOW_DOWN = "503 SlowDown"
    FORBIDDEN = "403 AccessDenied"
    RESET = "connection reset before the answer"
    RESET_IN_BODY = "connection reset in the middle of the body"
    CUT_BODY = "connection closed in the middle of the body"
    SHORT_BODY = "a body that is too short, and says that it is whole"
    WRONG_BYTES = "a body of the right length with other bytes"
    TRICKLE = "a body that comes in many small pieces"
    HANG = "no answer until the client gives up"
    STALE_LISTING = "a listing from before the upload"


@dataclass
class Plan:
    pattern: str
    fault: Fault
    times: int
    method: str = "GET"
    seen: int = 0


@dataclass(frozen=True)
class Passed:
    """A request that came by: with its `Range` header, and the fault that its answer got."""

    method: str
    path: str
    range: str
    fault: Fault | None


class FaultProxy:
    """Serves on a free port of the loopback; a context that ends with all its threads and connections."""

    def __init__(self, upstream: tuple[str, int]):
        self.passed: list[Passed] = []
        self.on_request: Callable[[str], None] | None = None
        self._plans: list[Plan] = []
        self._every = 0
        self._lock = threading.Lock()
        self._upstream = upstream
        self._closing = threading.Event()
        self._server = _Server(("127.0.0.1", 0), _Handler)
        self._server.proxy = self
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)

    def __enter__(self) -> "FaultProxy":
        self._thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._closing.set()
        self._server.shutdown()
        self._thread.join(timeout=10)
        self._server.server_close()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._server.server_address[1]}"

    def spoil(self, pattern: str, fault: Fault, times: int = 1, method: str = "GET") -> None:
        """The next `times` requests of a method whose path and query match `pattern` get `fault`."""
        with self._lock:
            self._plans.append(Plan(pattern, fault, times, method))

    def fail_every(self, number: int) -> None:
        """Every request of this number (the fifth, the tenth, ...) gets a 503; 0: none."""
        self._every = number

    def requests(self, pattern: str = "") -> list[Passed]:
        with self._lock:
            return [passed for passed in self.passed if re.search(pattern, passed.path)]

    def spoiled(self) -> int:
        with self._lock:
            return sum(passed.fault is not None for passed in self.passed)

    def fault_of(self, method: str, path: str, byte_range: str) -> Fault | None:
        if self.on_request is not None:
            self.on_request(path)
        with self._lock:
            fits = (one for one in self._plans if one.method == method and one.times > one.seen)
            plan = next((one for one in fits if re.search(one.pattern, path)), None)
            is_due = self._every and len(self.passed) % self._every == self._every - 1
            fault = plan.fault if plan is not None else Fault.SLOW_DOWN if is_due else None
            if plan is not None:
                plan.seen += 1
            self.passed.append(Passed(method, path, byte_range, fault))
            return fault

    def forward(
        self, method: str, path: str, headers: dict[str, str], body: bytes
    ) -> tuple[int, dict[str, str], bytes]:
        headers = {"Authorization": ANYBODY} | headers
        connection = http.client.HTTPConnection(*self._upstream, timeout=_UPSTREAM_TIMEOUT_S)
        try:
            connection.request(method, path, body or None, headers)
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()

    def wait(self, seconds: float) -> None:
        self._closing.wait(seconds)

    @property
    def is_closing(self) -> bool:
        return self._closing.is_set()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    proxy: FaultProxy

    def handle_error(self, request: object, client_address: object) -> None:
        """Clients that give up are what this proxy is for."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: _Server
    timeout = 30.0

    def _handle(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        proxy = self.server.proxy
        fault = proxy.fault_of(self.command, self.path, self.headers.get("Range", ""))
        if fault is Fault.RESET:
            self._reset()
        elif fault is Fault.SLOW_DOWN:
            self._answer(503, {"Content-Type": "application/xml"}, SLOW_DOWN)
        elif fault is Fault.FORBIDDEN:
            self._answer(403, {"Content-Type": "application/xml"}, DENIED)
        elif fault is Fault.HANG:
            self._hang()
        elif fault is Fault.STALE_LISTING:
            self._answer(200, {"Content-Type": "application/xml"}, NO_LISTING)
        else:
            self._spoil(fault, *proxy.forward(self.command, self.path, dict(self.headers.items()), body))

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = _handle

    def _spoil(self, fault: Fault | None, status: int, headers: dict[str, str], body: bytes) -> None:
        if fault is Fault.SHORT_BODY:
            body = body[: len(body) // 2]
        elif fault is Fault.WRONG_BYTES:
            body = bytes([body[0] ^ 0xFF]) + body[1:-1] + bytes([body[-1] ^ 0xFF])
            headers = {name: value for name, value in headers.items() if not name.lower().startswith("x-amz-checksum")}
        self._answer(status, headers, body, fault)

    def _answer(self, status: int, headers: dict[str, str], body: bytes, fault: Fault | None = None) -> None:
        self.send_response(status)
        for name, value in headers.items():
            if name.lower() not in ("connection", "transfer-encoding", "content-length", "date", "server"):
                self.send_header(name, value)
        length = headers.get("Content-Length") if self.command == "HEAD" else str(len(body))
        self.send_header("Content-Length", length or "0")
        self.end_headers()
        if fault in (Fault.CUT_BODY, Fault.RESET_IN_BODY):
            self.wfile.write(body[: len(body) // 2])
            self.wfile.flush()
            self._reset() if fault is Fault.RESET_IN_BODY else self._close()
        elif fault is Fault.TRICKLE:
            self._trickle(body)
        elif self.command != "HEAD":
            self.wfile.write(body)

    def _trickle(self, body: bytes) -> None:
        """All of the body, in pieces over about half a second."""
        pieces = 25
        size = -(-len(body) // pieces)
        for begin in range(0, len(body), max(size, 1)):
            self.wfile.write(body[begin : begin + size])
            self.wfile.flush()
            self.server.proxy.wait(0.02)

    def _hang(self) -> None:
        """Say nothing until the client closes the connection, or the proxy is closed."""
        self.connection.settimeout(0.1)
        until = time.monotonic() + 120
        while time.monotonic() < until and not self.server.proxy.is_closing:
            try:
                if not self.connection.recv(1):
                    break
            except TimeoutError:
                continue
        self._close()

    def _reset(self) -> None:
        """Close with an RST in place of a FIN: nothing lingers."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._close()

    def _close(self) -> None:
        self.close_connection = True
        self.connection.close()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Nothing: the proxy keeps its own record."""
