"""Processes that share a cache, and processes that are killed in a download."""

import hashlib
import json
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from dataclasses import astuple
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[1] / "fakes" / "read_shards.py"
TIMEOUT_S = 120
SLOW = pytest.mark.slow


@pytest.fixture
def cache(tmp_path):
    return tmp_path / "cache"


@pytest.fixture
def reading(remote, cache):
    """Starts a process that reads stretches through the cache; it is killed at the end at the latest."""

    @contextmanager
    def start(spans, cache_bytes):
        command = [sys.executable, str(PROGRAM), remote.url, str(cache), str(cache_bytes)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            try:
                process.stdin.write(json.dumps([astuple(span) for span in spans]))
                process.stdin.close()
                yield process
            finally:
                process.kill()

    return start


def digests(published, spans):
    return [hashlib.sha256(published.bytes_of(span)).hexdigest() for span in spans]


def output(process):
    """What a process printed, once it ended well."""
    timer = threading.Timer(TIMEOUT_S, process.kill)
    timer.start()
    try:
        lines = process.stdout.read().split()
        assert process.wait() == 0
        return lines
    finally:
        timer.cancel()


def largest(published):
    return max(shard.bytes for shard in published.manifest.shards)


def held_bytes(cache):
    total = 0
    for path in cache.rglob("*"):
        try:
            total += path.stat().st_size if path.suffix in (".tar", ".partial") else 0
        except FileNotFoundError:
            continue
    return total


def require_only_whole_shards(cache, published):
    """No file that the cache would believe holds anything but the shard of its name."""
    wanted = {shard.name: shard.sha256 for shard in published.manifest.shards}
    for path in cache.glob("*/*.tar"):
        assert hashlib.sha256(path.read_bytes()).hexdigest() == wanted[path.name]


@pytest.mark.parametrize("shards", [2.5, pytest.param(1.0, marks=SLOW), pytest.param(100.0, marks=SLOW)])
def test_two_processes_share_a_cache(reading, published, cache, shards):
    limit = int(shards * largest(published))
    orders = [published.spans, published.spans[::-1]]
    held = []
    with reading(orders[0], limit) as one, reading(orders[1], limit) as other:
        while one.poll() is None or other.poll() is None:
            held.append(held_bytes(cache))
            threading.Event().wait(0.005)
        assert [output(one), output(other)] == [digests(published, order) for order in orders]
    assert 0 < max(held) <= limit
    require_only_whole_shards(cache, published)
    assert not list(cache.glob("*/.*.partial"))


@SLOW
def test_with_room_for_all_each_shard_is_downloaded_once_by_either(reading, published, remote):
    limit = 100 * largest(published)
    with reading(published.spans, limit) as one, reading(published.spans, limit) as other:
        assert output(one) == output(other) == digests(published, published.spans)
    ranges = [(passed.path, passed.range) for passed in remote.proxy.requests(r"\.tar")]
    assert len(set(ranges)) == len(ranges)


@pytest.mark.parametrize("requests", [7, pytest.param(1, marks=SLOW), pytest.param(23, marks=SLOW)])
def test_what_a_killed_download_leaves_is_never_believed(reading, published, remote, cache, requests):
    seen, reached = [], threading.Event()

    def count(path):
        if path.endswith(".tar"):
            seen.append(path)
            if len(seen) == requests:
                reached.set()
                threading.Event().wait(0.3)  # the kill comes before the answer

    remote.proxy.on_request = count
    limit = 2 * largest(published)
    with reading(published.spans, limit) as process:
        assert reached.wait(TIMEOUT_S)
        process.send_signal(signal.SIGKILL)
        assert process.wait(TIMEOUT_S) == -signal.SIGKILL
    assert list(cache.glob("*/.*.partial"))
    require_only_whole_shards(cache, published)
    with reading(published.spans, limit) as process:
        assert output(process) == digests(published, published.spans)
    assert not list(cache.glob("*/.*.partial"))
    require_only_whole_shards(cache, published)


@SLOW
def test_a_process_goes_on_when_the_one_it_waits_for_is_killed(reading, published, remote, cache):
    held_up = threading.Event()

    def hold_up(path):
        if path.endswith(".tar") and not held_up.is_set():
            held_up.set()
            threading.Event().wait(2.0)

    remote.proxy.on_request = hold_up
    limit = 2 * largest(published)
    with reading(published.spans, limit) as first:
        assert held_up.wait(TIMEOUT_S)
        with reading(published.spans, limit) as second:
            threading.Event().wait(0.5)
            first.kill()
            assert output(second) == digests(published, published.spans)
    require_only_whole_shards(cache, published)
