"""A codec in a process of its own, asked through a socket: several processes share few loaded networks.

A request is a connection: a JSON object, the arrays that its `shapes` announce, and the answer in the same form.
Whoever is free among the servers that accept from one socket takes the next: none waits while another has a queue.
"""

import json
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection
from typing import Any

import numpy as np

from wsm_data.codecs.base import VideoCodec
from wsm_data.errors import WsmError
from wsm_data.files.json_values import from_json, to_json
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.codec import CodecInfo


@dataclass(frozen=True)
class ServedCodec:
    """What `wsm encode` asks of a `VideoCodec`, answered by a server.

    Attributes:
        address: path of the servers' socket.
    """

    address: str

    def encode_many(self, videos: Sequence[Float32Array]) -> list[Float32Array]:
        """See `VideoCodec.encode_many`; the videos of one call are one call of the server's codec."""
        return self._ask("encode_many", videos)[1]

    def decode(self, latents: Float32Array) -> Float32Array:
        """See `VideoCodec.decode`."""
        return self._ask("decode", [latents])[1][0]

    def describe(self) -> CodecInfo:
        """See `VideoCodec.describe`."""
        return from_json(CodecInfo, self._ask("describe", [])[0]["codec"])

    def _ask(self, call: str, arrays: Sequence[Float32Array]) -> tuple[dict[str, Any], list[Float32Array]]:
        try:
            with Client(self.address, family="AF_UNIX") as connection:
                _send(connection, {"call": call}, arrays)
                answer, results = _receive(connection)
        except (OSError, EOFError) as error:
            raise WsmError(
                f"the process that holds the codec ended ({error or 'no answer'}; its own message stands above); what "
                "was finished is kept: run the same command again"
            ) from error
        if "refused" in answer:
            raise ValueError(answer["refused"])
        return answer, results


def answer_one(listening: socket.socket, codec: VideoCodec) -> float:
    """Wait for a request at the socket, and answer it; one whose asker is gone is dropped.

    Returns:
        Seconds from the request to its answer.
    """
    accepted, _ = listening.accept()
    began = time.monotonic()
    with Connection(accepted.detach()) as connection:
        try:
            request, arrays = _receive(connection)
            try:
                extra, results = _answered(codec, request["call"], arrays)
            except ValueError as error:
                extra, results = {"refused": str(error)}, []
            _send(connection, extra, results)
        except (OSError, EOFError):
            pass
    return time.monotonic() - began


def _answered(
    codec: VideoCodec, call: str, arrays: list[Float32Array]
) -> tuple[dict[str, object], Sequence[Float32Array]]:
    match call:
        case "encode_many":
            return {}, codec.encode_many(arrays)
        case "decode":
            return {}, [codec.decode(arrays[0])]
        case "describe":
            return {"codec": to_json(codec.describe())}, []
    raise ValueError(f"a codec is asked for encode_many, decode or describe, found {call!r}")


def _send(connection: Connection, header: dict[str, object], arrays: Sequence[Float32Array]) -> None:
    connection.send_bytes(json.dumps({**header, "shapes": [array.shape for array in arrays]}).encode())
    for array in arrays:
        connection.send_bytes(np.ascontiguousarray(array, np.float32).data.cast("B"))


def _receive(connection: Connection) -> tuple[dict[str, Any], list[Float32Array]]:
    header = json.loads(connection.recv_bytes())
    arrays = [np.empty(shape, np.float32) for shape in header["shapes"]]
    for array in arrays:
        connection.recv_bytes_into(array.data.cast("B"))
    return header, arrays
