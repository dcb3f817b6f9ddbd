"""One loaded codec a GPU, each in a process of its own; the workers of a stage decode images and feed them."""

import json
import logging
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from wsm_data.codecs.registry import CodecConfig, make_codec
from wsm_data.codecs.served import answer_one
from wsm_data.errors import ConfigError, WsmError
from wsm_data.files.json_values import from_json, to_json

_LOG = logging.getLogger(__name__)
_READY = "ready"
_QUEUE = 1024
_VISIBLE = "CUDA_VISIBLE_DEVICES"


@contextmanager
def codec_servers(config: CodecConfig, gpus: int) -> Iterator[str]:
    """Start a server a GPU, and end them after the body; yields the address at which `ServedCodec` asks them.

    A server encodes what one request holds as one call, `batch_clips` clips: the bytes are those of a worker that has
    the codec itself on a device of this kind.

    Raises:
        ConfigError: the codec has no use for a GPU, or there are fewer of them.
        WsmError: a server could not load the codec.
    """
    require_gpus(config, gpus)
    with TemporaryDirectory(prefix="wsm-codec-") as folder, ExitStack() as stack:
        address = str(Path(folder) / "socket")
        with socket.socket(socket.AF_UNIX) as listening:  # ours is closed here: once all servers ended, nobody waits
            listening.bind(address)
            listening.listen(_QUEUE)
            servers = [stack.enter_context(_server(config, listening, gpu)) for gpu in range(gpus)]
        for server in servers:
            _require_ready(server)
        yield address


def require_gpus(config: CodecConfig, gpus: int) -> None:
    """Check, before any work, that so many GPUs can encode.

    Raises:
        ConfigError: the codec has no use for a GPU, or there are fewer of them.
    """
    if config.name != "wan" or config.device == "cpu":
        raise ConfigError(f"--gpus is for codec wan, found {config.name} on {config.device}; leave --gpus out")
    found = device_count()
    if gpus > found:
        raise ConfigError(f"--gpus {gpus} needs as many CUDA devices on this machine, found {found}")


def device_count() -> int:
    """CUDA devices that this process may use."""
    import torch  # only where GPUs are asked for

    return torch.cuda.device_count()


@contextmanager
def _server(config: CodecConfig, listening: socket.socket, gpu: int) -> Iterator["subprocess.Popen[str]"]:
    visible = os.environ.get(_VISIBLE, "")
    device = visible.split(",")[gpu] if visible else str(gpu)
    number = listening.fileno()
    with subprocess.Popen(
        [sys.executable, "-m", "pipelines.artifacts.codec_servers", str(number), json.dumps(to_json(config))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, _VISIBLE: device},
        pass_fds=[number],
        text=True,
    ) as server:
        try:
            yield server
            said, _ = server.communicate()  # the end of its input ends it
            _LOG.info("codec on GPU %s: %s", device, said.strip())
        finally:
            server.kill()


def _require_ready(server: "subprocess.Popen[str]") -> None:
    if server.stdout is None or server.stdout.readline().strip() != _READY:
        raise WsmError("a process that was to hold the codec ended before it could; its own message stands above")


def _serve(number: int, config: CodecConfig) -> None:
    """Answer requests until standard input ends, as it does with the process that started this one."""
    codec = make_codec(config)
    began, busy = time.monotonic(), [0.0, 0.0]
    threading.Thread(target=_end_with_input, args=(began, busy), daemon=True).start()
    sys.stdout.write(f"{_READY}\n")
    sys.stdout.flush()
    with socket.socket(fileno=number) as listening:
        while True:
            busy[0] += answer_one(listening, codec)
            busy[1] += 1


def _end_with_input(began: float, busy: list[float]) -> None:
    sys.stdin.read()
    waited = 1 - busy[0] / max(time.monotonic() - began, 1e-9)
    sys.stdout.write(f"{busy[1]:.0f} requests, waited {waited:.0%} of the time\n")
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    _serve(int(sys.argv[1]), from_json(CodecConfig, json.loads(sys.argv[2])))
