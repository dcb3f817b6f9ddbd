"""Our client, against a server that is written from the protocol's description alone, in good and bad moods."""

import contextlib
import email.parser
import io
import json
import socket
import threading
import time

import numpy as np
import pytest
from PIL import Image

from wsm_data.errors import ConfigError, RemotePlannerError
from wsm_data.planners.http.client import ClientConfig, HttpPlanner
from wsm_data.planners.http.fault import Fault
from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.server import PlannerServer, ServerConfig
from wsm_data.planners.http.service import PlannerService

NAME = b'{"algo": "other"}'


def ok(body, status="200 OK"):
    return f"HTTP/1.1 {status}\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body


def paths(batch, value=1.0):
    return json.dumps(
        {
            "trajectory": [[[0, 0, 0], [value, number, 0]] for number in range(batch)],
            "all_trajectory": [[[[0, 0, 0], [value, number, 0]]] for number in range(batch)],
            "all_values": [[0.5]] * batch,
            "sub_pointgoal_pd": [[3.0, 1.0, 0.0]] * batch,
        }
    ).encode()


class DescribedServer:
    """Reads one request a connection, keeps it, and sends what it is told to, or does what it is told to."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.listener.getsockname()[1]}"
        self.requests = []
        self.step_answer = ok(paths(1))
        self.reset_answer = ok(NAME)
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        while True:
            connection, _ = self.listener.accept()
            with connection, connection.makefile("rb") as file:
                first = file.readline().decode()
                if not first:
                    return
                headers = {}
                while (line := file.readline().decode().strip()) != "":
                    name, value = line.split(": ", 1)
                    headers[name.lower()] = value
                path = first.split()[1]
                self.requests.append((path, headers["content-type"], file.read(int(headers["content-length"]))))
                answer = self.step_answer if path == "/pointgoal_step" else self.reset_answer
                with contextlib.suppress(OSError):
                    answer(connection) if callable(answer) else connection.sendall(answer)

    def close(self):
        socket.create_connection(self.listener.getsockname()).close()  # an empty request ends it
        self.thread.join(20)
        self.listener.close()
        assert not self.thread.is_alive()


@pytest.fixture
def server():
    one = DescribedServer()
    yield one
    one.close()


@pytest.fixture
def quick():
    return ClientConfig(connect_timeout_s=2.0, reset_timeout_s=0.5, step_timeout_s=0.5, max_answer_bytes=100_000)


@pytest.fixture
def started(server, small_camera, quick):
    def make(batch=1):
        planner = HttpPlanner(server.url, quick)
        planner.reset(small_camera, batch)
        return planner

    return make


def described_parts(request):
    """The parts of a form, read by Python's reader of mail."""
    _, kind, body = request
    message = email.parser.BytesParser().parsebytes(f"Content-Type: {kind}\r\n\r\n".encode() + body)
    return {
        part.get_param("name", header="content-disposition"): (part.get_filename(), part.get_payload(decode=True))
        for part in message.get_payload()
    }


def test_a_reset_sends_the_matrix_the_threshold_and_the_batch(server, started, small_camera):
    planner = started(4)
    path, kind, body = server.requests[0]
    assert (path, kind) == ("/navigator_reset", "application/json")
    assert json.loads(body) == {
        "intrinsic": [[30.0, 0.0, 16.0], [0.0, 30.0, 8.0], [0.0, 0.0, 1.0]],
        "stop_threshold": -3.0,
        "batch_size": 4,
    }
    assert planner.name == "other"
    planner.reset_environment(2)
    assert server.requests[1][0] == "/navigator_reset_env"
    assert json.loads(server.requests[1][2]) == {"env_id": 2}


def test_a_step_of_four_is_one_picture_with_red_and_blue_exchanged(server, started, observe):
    server.step_answer = ok(paths(4))
    plans = started(4).plan({number: observe(number, (number, 1.0)) for number in range(4)})
    parts = described_parts(server.requests[1])
    assert {name: file for name, (file, _) in parts.items()} == {
        "goal_data": None,
        "depth_time": None,
        "rgb_time": None,
        "image": "image.jpg",
        "depth": "depth.png",
    }
    assert json.loads(parts["goal_data"][1]) == {"goal_x": [0.0, 1.0, 2.0, 3.0], "goal_y": [1.0] * 4}
    with Image.open(io.BytesIO(parts["image"][1])) as image:
        pixels = np.asarray(image)
    assert pixels.shape == (64, 32, 3)
    np.testing.assert_allclose(pixels[8::16, 4], [[0, 0, 250]] * 4, atol=12)
    np.testing.assert_allclose(pixels[8::16, 28], [[60 * n, 0, 0] for n in range(1, 5)], atol=12)
    assert [plans[n].path_m[1].tolist() for n in range(4)] == [[1.0, n, 0.0] for n in range(4)]
    assert plans[3].goal_estimate_m.tolist() == [3.0, 1.0, 0.0]
    assert plans[3].values.tolist() == [0.5]


@pytest.mark.parametrize(("metres", "code"), [(1.99999, 19999), (7.0, 65535), (0.0, 65535)])
def test_depth_is_truncated_and_what_nothing_was_measured_of_is_infinitely_far(server, started, observe, metres, code):
    started().plan({0: observe(depth_m=metres)})
    with Image.open(io.BytesIO(described_parts(server.requests[1])["depth"][1])) as image:
        codes = np.asarray(image)
    assert np.unique(codes).tolist() == [code]


def test_who_asks_for_nothing_is_sent_with_what_it_showed_last(server, started, observe):
    server.step_answer = ok(paths(2))
    planner = started(2)
    planner.plan({0: observe(0), 1: observe(1)})
    plans = planner.plan({1: observe(1, (9.0, 9.0))})
    assert list(plans) == [1]
    goals = json.loads(described_parts(server.requests[2])["goal_data"][1])
    assert goals == {"goal_x": [3.0, 9.0], "goal_y": [-1.0, 9.0]}


def late(connection):
    connection.recv(1)  # until the client has gone


def dripping(connection):
    connection.sendall(b"HTTP/1.1 200 OK\r\n\r\n")
    for _ in range(60):
        connection.sendall(b" ")
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("answer", "fault"),
    [
        (late, Fault.LATE),
        (dripping, Fault.LATE),
        (b"", Fault.CUT_OFF),
        (ok(paths(1))[:-20], Fault.CUT_OFF),
        (b"garbage\r\n\r\n", Fault.MALFORMED),
        (ok(b"<html>"), Fault.MALFORMED),
        (ok(b"{}"), Fault.MALFORMED),
        (ok(paths(1, float("nan"))), Fault.NOT_FINITE),
        (ok(paths(4)), Fault.WRONG_BATCH),
        (ok(b"oh", "500 Internal Server Error"), Fault.STATUS),
        (ok(b" " * 200_000), Fault.TOO_LARGE),
        (b"HTTP/1.1 200 OK\r\n\r\n" + b" " * 200_000, Fault.TOO_LARGE),
    ],
    ids=[
        "late", "drips", "silent end", "cut", "no http", "no json", "no path", "nan", "batch", "500", "large", "endless"
    ],
)  # fmt: skip
def test_an_answer_of_no_use_keeps_the_path_and_is_counted_by_name(server, started, observe, answer, fault):
    planner = started()
    server.step_answer = answer
    assert planner.plan({0: observe()}) == {0: None}
    assert planner.faults == {fault: 1}
    server.step_answer = ok(paths(1))
    assert planner.plan({0: observe()})[0] is not None


def test_a_server_that_is_gone_keeps_the_path_and_is_counted(small_camera, quick, observe):
    server = DescribedServer()
    planner = HttpPlanner(server.url, quick)
    planner.reset(small_camera, 1)
    server.close()
    assert planner.plan({0: observe()}) == {0: None}
    assert planner.faults == {Fault.UNREACHABLE: 1}


@pytest.mark.parametrize("answer", [ok(b"{}"), ok(b"no", "500 no"), late, b""])
def test_a_reset_that_fails_is_an_error(server, small_camera, quick, answer):
    server.reset_answer = answer
    with pytest.raises(RemotePlannerError, match="navigator_reset"):
        HttpPlanner(server.url, quick).reset(small_camera, 1)


def test_where_nobody_listens_a_reset_is_an_error(small_camera, quick):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(RemotePlannerError, match="nothing answers"):
        HttpPlanner(f"http://127.0.0.1:{port}", quick).reset(small_camera, 1)


@pytest.mark.parametrize("url", ["127.0.0.1:80", "https://host", "http://", "http://host/path", "http://host:port"])
def test_urls_of_another_form_are_refused(url):
    with pytest.raises(ConfigError, match="URL"):
        HttpPlanner(url, ClientConfig())


def test_our_server_and_our_client_understand_one_another(recording, small_camera, observe):
    server = PlannerServer(PlannerService(recording, GoalClient.START_GOAL), ServerConfig(port=0))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        planner = HttpPlanner(server.url, ClientConfig())
        planner.reset(small_camera, 2)
        plans = planner.plan({0: observe(0, (1.0, 2.0)), 1: observe(1, (3.0, 4.0))})
        recording.answers = lambda number, seen: None
        kept = planner.plan({0: observe(0), 1: observe(1)})
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    assert planner.name == "recording"
    assert [plans[n].path_m[-1].tolist() for n in range(2)] == [[1.0, 2.0, 0.0], [3.0, 4.0, 0.0]]
    assert kept == {0: None, 1: None}
    assert not planner.faults
