"""Our server, against a client that is written from the protocol's description alone."""

import contextlib
import http.client
import io
import json
import socket
import struct
import threading
import time

import numpy as np
import pytest
from PIL import Image

from wsm_data.planners.http.goal_client import GoalClient
from wsm_data.planners.http.server import PlannerServer, ServerConfig
from wsm_data.planners.http.service import PlannerService
from wsm_data.planners.planner import Plan

BOUNDARY = "0123456789"


def description_image(rgb):
    """Frames one below the other, red and blue exchanged, JPEG of quality 95 by an encoder that is not OpenCV."""
    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(rgb.reshape(-1, *rgb.shape[2:])[..., ::-1])).save(file, "JPEG", quality=95)
    return file.getvalue()


def description_depth(depth_m):
    codes = np.clip(depth_m.reshape(-1, depth_m.shape[-1]) * np.float32(10000), 0, 65535).astype(np.uint16)
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "PNG")
    return file.getvalue()


def description_body(rgb, depth_m, goals):
    goal_data = json.dumps({"goal_x": [x for x, _ in goals], "goal_y": [y for _, y in goals]}).encode()
    parts = [
        (b'name="goal_data"', goal_data),
        (b'name="depth_time"', b"1700000000.5"),
        (b'name="rgb_time"', b"1700000000.5"),
        (b'name="image"; filename="image.jpg"\r\nContent-Type: image/jpeg', description_image(rgb)),
        (b'name="depth"; filename="depth.png"\r\nContent-Type: image/png', description_depth(depth_m)),
    ]
    edge = f"--{BOUNDARY}".encode()
    whole = b"".join(
        edge + b"\r\nContent-Disposition: form-data; " + head + b"\r\n\r\n" + data + b"\r\n" for head, data in parts
    )
    return whole + edge + b"--\r\n"


class Client:
    def __init__(self, server):
        self.server = server

    def send(self, path, body, kind="application/json", method="POST"):
        connection = http.client.HTTPConnection(*self.server.server_address, timeout=120)
        with contextlib.closing(connection):
            connection.request(method, path, body, {"Content-Type": kind})
            response = connection.getresponse()
            return response.status, json.loads(response.read())

    def reset(self, batch=1):
        record = {"intrinsic": [[30, 0, 16], [0, 30, 8], [0, 0, 1]], "stop_threshold": -3.0, "batch_size": batch}
        return self.send("/navigator_reset", json.dumps(record))

    def step(self, rgb, depth_m, goals, path="/pointgoal_step"):
        return self.send(path, description_body(rgb, depth_m, goals), f"multipart/form-data; boundary={BOUNDARY}")

    def health(self):
        return self.send("/health", None, method="GET")[1]


@pytest.fixture
def serving(recording):
    @contextlib.contextmanager
    def make(client=GoalClient.POINT_GOAL, **limits):
        server = PlannerServer(PlannerService(recording, client), ServerConfig(port=0, **limits))
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield Client(server)
        finally:
            server.shutdown()
            server.server_close()
            thread.join(20)
            assert not thread.is_alive()

    return make


def depth(batch, metres=2.0):
    return np.full((batch, 16, 32), metres, np.float32)


def raw(client, data):
    sock = socket.create_connection(client.server.server_address, timeout=120)
    sock.sendall(data)
    return sock


def soon(check):
    """Wait until something is so; ten seconds at most."""
    end = time.monotonic() + 10
    while time.monotonic() < end:
        if check():
            return True
        time.sleep(0.01)
    return False


def test_a_batch_of_four_arrives_with_its_colours_depths_and_goals(serving, recording, red_left):
    depth_m = np.stack([depth(1, metres)[0] for metres in (0.12349, 1.99999, 6.0, np.inf)])
    with serving() as client:
        assert client.reset(4) == (200, {"algo": "recording"})
        status, answer = client.step(red_left(4), depth_m, [(n, -n) for n in range(4)])
    assert status == 200
    seen = recording.seen[0]
    assert sorted(seen) == [0, 1, 2, 3]
    for number, one in seen.items():
        np.testing.assert_allclose(one.rgb_u8[8, 4], [250, 0, 0], atol=12)
        np.testing.assert_allclose(one.rgb_u8[8, 28], [0, 0, 60 * (number + 1)], atol=12)
        assert one.goal_xy_m.tolist() == [number, -number]
    codes = [1234, 19999, 60000, 0]  # truncated; what nothing was hit at is no measurement
    assert [seen[n].depth_m[0, 0] for n in range(4)] == [np.float32(code / 10000) for code in codes]
    assert np.shape(answer["trajectory"]) == (4, 2, 3)
    assert np.shape(answer["all_trajectory"]) == (4, 1, 2, 3)
    assert np.shape(answer["all_values"]) == (4, 1)


def test_a_switch_gives_or_keeps_the_one_key_by_which_clients_differ(serving, red_left):
    for client_kind, expected in ((GoalClient.START_GOAL, True), (GoalClient.POINT_GOAL, False)):
        with serving(client_kind) as client:
            client.reset()
            _, answer = client.step(red_left(1), depth(1), [(3.0, 1.0)])
        assert ("sub_pointgoal_pd" in answer) is expected


def test_a_reset_of_one_environment_leaves_the_others(serving, recording, red_left):
    with serving() as client:
        client.reset(2)
        client.step(red_left(2), depth(2), [(1, 1), (2, 2)])
        assert client.send("/navigator_reset_env", '{"env_id": 0}') == (200, {"algo": "recording"})
        client.step(red_left(2), depth(2), [(1, 1), (2, 2)])
    assert [one.step for one in recording.seen[1].values()] == [0, 1]


@pytest.mark.parametrize("path", ["/nogoal_step", "/imagegoal_step", "/pixelgoal_step", "/navdp_step_ip_mixgoal"])
def test_goals_that_no_planner_here_can_drive_to_are_refused_in_words(serving, red_left, path):
    with serving() as client:
        client.reset()
        status, answer = client.step(red_left(1), depth(1), [(1, 1)], path)
        assert status == 501
        assert "recording drives to points" in answer["error"]
        assert client.health()["faults"] == {"unsupported": 1}


@pytest.mark.parametrize(
    ("path", "body", "status", "fault"),
    [
        ("/navigator_reset", "{", 400, "malformed"),
        ("/navigator_reset", '{"intrinsic": [[NaN]], "batch_size": 1}', 400, "not_finite"),
        ("/navigator_reset_env", '{"env_id": 0}', 409, "out_of_turn"),
        ("/pointgoal_step", "no form", 400, "malformed"),
        ("/elsewhere", "{}", 501, "unsupported"),
    ],
)
def test_requests_of_no_use_are_answered_with_their_reason_and_counted(serving, path, body, status, fault):
    with serving() as client:
        found, answer = client.send(path, body)
        assert found == status
        assert answer["error"]
        assert client.health()["faults"] == {fault: 1}


def test_a_batch_of_another_size_than_agreed_is_refused(serving, red_left):
    with serving() as client:
        client.reset(4)
        status, answer = client.step(red_left(2), depth(2), [(1, 1)] * 2)
        assert (status, client.health()["faults"]) == (400, {"wrong_batch": 1})
        assert "[4]" in answer["error"]


def test_a_planner_that_cannot_answer_is_an_error_of_the_server_and_the_next_request_works(
    serving, recording, red_left
):
    def fail(number, seen):
        raise ValueError("no way")

    with serving() as client:
        client.reset()
        recording.answers = fail
        status, answer = client.step(red_left(1), depth(1), [(1, 1)])
        assert (status, client.health()["faults"]) == (500, {"planner": 1})
        assert "no way" in answer["error"]
        recording.answers = None
        assert client.step(red_left(1), depth(1), [(1, 1)])[0] == 200


def test_a_client_that_dies_in_mid_request_is_counted_and_leaves_no_step(serving, recording, red_left):
    body = description_body(red_left(1), depth(1), [(1, 1)])
    head = f"POST /pointgoal_step HTTP/1.1\r\nHost: x\r\nContent-Length: {len(body)}\r\n\r\n".encode()
    with serving() as client:
        client.reset()
        raw(client, head + body[:100]).close()
        abrupt = raw(client, head + body[:100])
        abrupt.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # a reset in place of an end
        abrupt.close()
        assert soon(lambda: client.health()["faults"].get("cut_off", 0) >= 2)
        assert client.step(red_left(1), depth(1), [(1, 1)])[0] == 200
    assert [seen[0].step for seen in recording.seen] == [0]


def test_a_client_that_drips_is_answered_when_its_time_is_over(serving):
    with serving(request_timeout_s=0.3) as client:
        with raw(client, b"POST /navigator_reset HTTP/1.1\r\nContent-Length: 1000\r\n\r\n{") as sock:
            assert b"408" in sock.makefile("rb").read()
        assert client.health()["faults"] == {"late": 1}


def test_a_client_that_never_speaks_does_not_keep_others_waiting(serving):
    with serving(request_timeout_s=0.5) as client, raw(client, b""):
        assert client.reset()[0] == 200


@pytest.mark.parametrize(
    ("header", "status", "fault"),
    [
        ("Content-Length: 2000", b"413", "too_large"),
        ("Content-Length: 9" + "9" * 4000, b"413", "too_large"),
        ("Content-Length: -1", b"400", "malformed"),
        ("Transfer-Encoding: chunked", b"400", "malformed"),
    ],
)
def test_a_body_too_large_or_of_no_known_size_is_refused_unread(serving, header, status, fault):
    with serving(max_request_bytes=1000) as client:
        with raw(client, f"POST /navigator_reset HTTP/1.1\r\n{header}\r\n\r\n".encode()) as sock:
            assert status in sock.makefile("rb").read()
        assert client.health()["faults"] == {fault: 1}


def test_more_connections_than_there_is_room_for_are_closed_at_once(serving):
    with serving(max_connections=1) as client, raw(client, b"POST"):
        with raw(client, b"") as second:
            assert second.recv(10) == b""
        assert client.server.health()["faults"] == {"too_large": 1}


def test_the_health_page_says_what_was_done(serving, red_left):
    with serving() as client:
        client.reset(2)
        client.step(red_left(2), depth(2), [(1, 1)] * 2)
        record = client.health()
        assert client.send("/other", None, method="GET")[0] == 404
    assert record["answered"] == {"/navigator_reset": 1, "/pointgoal_step": 1}
    assert (record["status"], record["algo"], record["environments"]) == ("ok", "recording", 2)
    assert record["faults"] == {}


def test_what_is_being_answered_at_the_end_is_answered(serving, recording, red_left):
    began, go_on, answers = threading.Event(), threading.Event(), []

    def slow(number, seen):
        began.set()
        go_on.wait(10)
        return Plan(path_m=np.zeros((2, 2)))

    with serving() as client:
        client.reset()
        recording.answers = slow
        asking = threading.Thread(target=lambda: answers.append(client.step(red_left(1), depth(1), [(1, 1)])[0]))
        asking.start()
        assert began.wait(10)
        threading.Timer(0.2, go_on.set).start()
    asking.join(10)
    assert answers == [200]
