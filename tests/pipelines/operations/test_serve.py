"""wsm serve, as a process of its own."""

import http.client
import json
import signal
import socket
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from pipelines.cli import app


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_served_planner_answers_and_ends_in_order(number):
    command = [sys.executable, "-u", "-m", "pipelines.cli", "serve", "--planner", "reactive"]
    with subprocess.Popen(
        [*command, "--client", "point-goal", "--port", "0"], stdout=subprocess.PIPE, text=True
    ) as process:
        first = process.stdout.readline()
        host, port = first.split("http://")[1].split(",")[0].split(":")
        connection = http.client.HTTPConnection(host, int(port), timeout=120)
        connection.request("GET", "/health")
        health = json.loads(connection.getresponse().read())
        connection.close()
        process.send_signal(number)
        assert process.wait(20) == 0
    assert (health["algo"], health["client"]) == ("reactive", "point-goal")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--planner", "oracle", "--port", "0"], "needs the map"),
        (["--planner", "reactive", "--port", "0"], "point-goal clients"),
        (["--planner", "map-and-plan", "--client", "point-goal", "--port", "0"], "needs its true pose"),
        (["--planner", "nobody", "--port", "0"], "must be one of"),
        (["--planner", "agent", "--port", "0"], "--model FOLDER belongs to --planner agent"),
        (["--planner", "reactive", "--model", "m", "--port", "0"], "--model FOLDER belongs to --planner agent"),
        (["--planner", "agent", "--model", "nowhere", "--port", "0"], "nowhere"),
    ],
)
def test_planners_that_cannot_be_served_are_refused_before_listening(words, reason):
    done = CliRunner().invoke(app, ["serve", *words])
    assert done.exit_code == 2
    assert reason in done.output


def test_a_port_that_is_taken_is_refused():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = CliRunner().invoke(app, ["serve", "--planner", "map-and-plan-estimated", "--port", port])
    assert done.exit_code == 2
    assert "free address" in done.output
