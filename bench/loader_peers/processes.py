"""A contestant's process, seen from the one that measures."""

import json
import os
import selectors
import signal
import subprocess
from pathlib import Path
from typing import Any

_BENCH = Path(__file__).parents[1]
_ANSWERS_WITHIN_S = 180.0
_ENDS_WITHIN_S = 20.0


class Child:
    """Answers requests of `loader_peers.worker`, one at a time."""

    def __init__(self, python: Path, module: str, bench: Path = _BENCH):
        """Start it in the folder `bench` of a checkout of the project, and wait until its imports are done."""
        self._module = module
        self._process = subprocess.Popen(
            [python, "-m", "loader_peers.worker", module],
            cwd=bench,
            env={**os.environ, "PYTHONPATH": str(bench.parent)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # so that its own worker processes end with it, whatever state they are in
        )
        self._answer()

    def ask(self, request: str, **arguments: object) -> dict[str, Any]:
        """Send a request and wait for its answer.

        Raises:
            RuntimeError: the process has ended or hangs; what it had to say is on standard error.
        """
        self._process.stdin.write(json.dumps({"do": request, **arguments}).encode() + b"\n")
        self._process.stdin.flush()
        return self._answer()

    @property
    def cpu_s(self) -> float:
        """Processor time of all its threads so far, s."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self) -> None:
        """Let it end, and end what is left of it."""
        self._process.stdin.close()
        self._process.stdout.close()
        try:
            self._process.wait(timeout=_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            self._kill()

    def __enter__(self) -> "Child":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _answer(self) -> dict[str, Any]:
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            if not selector.select(timeout=_ANSWERS_WITHIN_S):
                self._kill()
                raise RuntimeError(f"{self._module} has not answered within {_ANSWERS_WITHIN_S:.0f} s")
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self._module} ended with {self._process.wait()}")
        return json.loads(line)

    def _kill(self) -> None:
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
