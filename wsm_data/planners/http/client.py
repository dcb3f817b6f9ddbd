"""Any planner behind the public HTTP protocol as a planner of ours."""

import http.client
import json
import logging
import socket
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

import numpy as np

from wsm_data.errors import ConfigError, RemotePlannerError
from wsm_data.planners.http.answer import decode_answer
from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.form import FormFile, write_form
from wsm_data.planners.http.time_limit import TimeLimit
from wsm_data.planners.http.wire import encode_depth, encode_goals, encode_image, read_object
from wsm_data.planners.planner import Observation, Plan, Sense
from wsm_data.schema.arrays import Float32Array, Uint8Array
from wsm_data.schema.camera import Intrinsics

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class ClientConfig:
    """How long to wait, and for what.

    Attributes:
        connect_timeout_s: for the server to take a connection.
        reset_timeout_s: for the whole answer to a reset; public servers load their model on the first.
        step_timeout_s: for the whole answer to a step.
        max_answer_bytes: longer answers are not read.
        stop_threshold: sent with a reset: a public planner stands still where it values every path less.
    """

    connect_timeout_s: float = 5.0
    reset_timeout_s: float = 180.0
    step_timeout_s: float = 60.0
    max_answer_bytes: int = 64 << 20
    stop_threshold: float = -3.0


@dataclass(frozen=True, kw_only=True)
class _Sight:
    """What an environment showed last."""

    rgb_u8: Uint8Array
    depth_m: Float32Array


class HttpPlanner:
    """Plans by asking a server.

    A step that fails leaves the path that is being followed, as with the benchmark's own client; it is counted by
    name in `faults`. A reset that fails would leave the server in another episode, so it is an error.

    A request holds all environments. One that asks for nothing is in it with what it showed last, and its path is not
    used; a server with a memory of pictures then sees that picture again.

    Args:
        url: of the server, as http://127.0.0.1:8888.
        config: limits.

    Raises:
        ConfigError: the URL is not of this form.
    """

    def __init__(self, url: str, config: ClientConfig):
        self.name = url
        self.senses = frozenset({Sense.RGB, Sense.DEPTH})
        self.faults: Counter[Fault] = Counter()
        self._host, self._port = _address(url)
        self._url = url
        self._config = config
        self._sights: list[_Sight | None] = []
        self._goals = np.zeros((0, 2))

    def reset(self, intrinsics: Intrinsics, environments: int) -> None:
        """Forget everything, here and behind the URL.

        Raises:
            RemotePlannerError: the server does not answer as it must.
        """
        record = {
            "intrinsic": intrinsics.matrix.tolist(),
            "stop_threshold": self._config.stop_threshold,
            "batch_size": environments,
        }
        self.name = self._reset("/navigator_reset", record)
        self._sights = [None] * environments
        self._goals = np.zeros((environments, 2))

    def reset_environment(self, environment: int) -> None:
        """Forget one environment, here and behind the URL.

        Raises:
            RemotePlannerError: the server does not answer as it must.
        """
        self._reset("/navigator_reset_env", {"env_id": environment})
        self._sights[environment] = None

    def plan(self, observations: Mapping[int, Observation]) -> Mapping[int, Plan | None]:
        """Ask for all environments at once; None for each where the answer is of no use."""
        for number, observation in observations.items():
            self._sights[number] = _sight(observation)
            self._goals[number] = observation.goal_xy_m
        try:
            plans = self._step()
        except WireError as error:
            self._count(error)
            return dict.fromkeys(observations)
        return {number: plans[number] for number in observations}

    def _step(self) -> list[Plan] | list[None]:
        known = next(one for one in self._sights if one is not None)
        sights = [one or known for one in self._sights]
        kind, body = write_form(
            {"goal_data": encode_goals(self._goals), "depth_time": "0", "rgb_time": "0"},
            {
                "image": FormFile(
                    name="image.jpg",
                    media_type="image/jpeg",
                    data=encode_image(np.stack([one.rgb_u8 for one in sights])),
                ),
                "depth": FormFile(
                    name="depth.png",
                    media_type="image/png",
                    data=encode_depth(np.stack([one.depth_m for one in sights])),
                ),
            },
        )
        answer = self._post("/pointgoal_step", kind, body, self._config.step_timeout_s)
        if read_object(answer, "the answer").get("keep") is True:
            return [None] * len(sights)
        return decode_answer(answer, len(sights))

    def _reset(self, path: str, record: Mapping[str, object]) -> str:
        try:
            answer = self._post(path, "application/json", json.dumps(record).encode(), self._config.reset_timeout_s)
            name = read_object(answer, "the answer").get("algo")
            if not isinstance(name, str):
                raise WireError(Fault.MALFORMED, f"the answer must name its `algo`, found {answer[:60]!r}")
        except WireError as error:
            self._count(error)
            raise RemotePlannerError(
                f"the planner at {self._url} must answer to {path}, but: {error}; is it running, and does it speak the "
                "protocol?"
            ) from error
        return name

    def _post(self, path: str, content_type: str, body: bytes, timeout_s: float) -> bytes:
        """Send a request and read its whole answer.

        Raises:
            WireError: `unreachable`, `late`, `cut_off`, `status`, `too_large`, or `malformed`.
        """
        connection = http.client.HTTPConnection(self._host, self._port, timeout=self._config.connect_timeout_s)
        try:
            connection.connect()
        except OSError as error:
            raise WireError(Fault.UNREACHABLE, f"nothing answers at {self._url}: {error}") from error
        sock = connection.sock
        sock.settimeout(None)  # the limit below is on the whole
        limit = TimeLimit(sock, timeout_s, socket.SHUT_RDWR)
        try:
            with limit:
                connection.request("POST", path, body, {"Content-Type": content_type})
                answer = self._read(connection.getresponse())
        except (OSError, http.client.HTTPException) as error:
            if limit.is_over:
                raise WireError(Fault.LATE, f"no whole answer within {timeout_s} s") from error
            if isinstance(error, OSError | http.client.IncompleteRead):
                raise WireError(
                    Fault.CUT_OFF, f"the server went away in the middle of its answer: {error!r}"
                ) from error
            raise WireError(Fault.MALFORMED, f"the answer is not HTTP: {error!r}") from error
        finally:
            connection.close()
        if limit.is_over:  # an answer without a length ends where it is cut
            raise WireError(Fault.LATE, f"no whole answer within {timeout_s} s")
        return answer

    def _read(self, response: http.client.HTTPResponse) -> bytes:
        most = self._config.max_answer_bytes
        answer = response.read(most + 1)
        if len(answer) > most:
            raise WireError(Fault.TOO_LARGE, f"an answer must have at most {most} bytes")
        if response.length:  # what is still missing: a read of a limited size does not say so itself
            raise http.client.IncompleteRead(answer, response.length)
        if response.status != http.client.OK:
            raise WireError(Fault.STATUS, f"status {response.status}: {answer[:200]!r}")
        return answer

    def _count(self, error: WireError) -> None:
        self.faults[error.fault] += 1
        _LOG.warning("%s: %s: %s", self._url, error.fault.value, error)


def _sight(observation: Observation) -> _Sight:
    """What goes out of an observation: where nothing was measured nothing was hit, at an infinite distance."""
    if observation.rgb_u8 is None or observation.depth_m is None:
        raise ValueError("the protocol sends pictures and depth, and the observation lacks one of them")
    depth = np.where(observation.depth_m == 0, np.float32(np.inf), observation.depth_m)
    return _Sight(rgb_u8=observation.rgb_u8, depth_m=depth)


def _address(url: str) -> tuple[str, int]:
    try:
        parts = urlsplit(url)
        if parts.scheme == "http" and parts.hostname and parts.path in ("", "/"):
            return parts.hostname, parts.port or http.client.HTTP_PORT
    except ValueError as error:
        raise ConfigError(f"a planner's URL must be like http://127.0.0.1:8888, found {url!r}: {error}") from error
    raise ConfigError(f"a planner's URL must be like http://127.0.0.1:8888, found {url!r}")
