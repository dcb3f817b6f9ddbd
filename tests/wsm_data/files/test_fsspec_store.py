"""A store behind a URL survives what passes, processes and forks; it never mistakes a failure for an absent file."""

import asyncio
import multiprocessing
import pickle
import threading
import time

import fsspec
import pytest
from fsspec.asyn import AsyncFileSystem
from fsspec.implementations.memory import MemoryFileSystem

from wsm_data.errors import ConfigError, StoreError
from wsm_data.files.fsspec_store import FsspecStore
from wsm_data.files.retries import RequestConfig

DATA = bytes(range(256)) * 4
FAST = RequestConfig(attempts=3, first_backoff_s=0.0, timeout_s=0.2)


class SpoiltFileSystem(AsyncFileSystem):
    """One file, `data`; what it answers is spoilt as the test says."""

    protocol = "spoilt"
    failures: list[Exception] = []  # noqa: RUF012 - shared with the test
    short_bodies = 0
    delay_s = 0.0
    calls = 0

    async def _answer(self):
        type(self).calls += 1
        await asyncio.sleep(self.delay_s)
        if self.failures:
            raise self.failures.pop(0)

    async def _info(self, path, **_):
        await self._answer()
        if not path.endswith("data"):
            raise FileNotFoundError(path)
        return {"name": path, "size": len(DATA), "type": "file"}

    async def _cat_file(self, path, start=None, end=None, **_):
        await self._answer()
        body = DATA[start:end]
        if self.short_bodies:
            type(self).short_bodies -= 1
            return body[: len(body) // 2]
        return body

    async def _ls(self, path, detail=True, **_):
        await self._answer()
        return [{"name": f"{path}/data", "size": len(DATA), "type": "file"}]


@pytest.fixture
def spoilt():
    fsspec.register_implementation("spoilt", SpoiltFileSystem, clobber=True)
    yield SpoiltFileSystem
    SpoiltFileSystem.failures, SpoiltFileSystem.short_bodies, SpoiltFileSystem.delay_s = [], 0, 0.0
    SpoiltFileSystem.calls = 0


@pytest.fixture
def store(spoilt):
    return FsspecStore("spoilt://folder", FAST)


QUESTIONS = {
    "exists": lambda store: store.exists("data"),
    "size": lambda store: store.size_bytes("data") == len(DATA),
    "names": lambda store: store.names() == ["data"],
    "read": lambda store: store.read("data") == DATA,
    "range": lambda store: store.read_range("data", 10, 50) == DATA[10:60],
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_every_question_is_asked_again_after_a_failure(store, spoilt, question):
    spoilt.failures = [ConnectionResetError(), TimeoutError()]
    assert QUESTIONS[question](store)
    assert not spoilt.failures


@pytest.mark.parametrize("question", QUESTIONS)
def test_every_question_that_stays_without_answer_is_an_error(store, spoilt, question):
    spoilt.failures = [ConnectionResetError() for _ in range(20)]
    with pytest.raises(StoreError, match=r"spoilt://folder.*3 attempts.*ConnectionResetError"):
        QUESTIONS[question](store)


def test_a_failure_is_not_taken_for_an_absent_file(store, spoilt):
    assert not store.exists("absent")
    spoilt.failures = [PermissionError("Access Denied")]
    with pytest.raises(StoreError, match="Access Denied"):
        store.exists("data")


@pytest.mark.parametrize("question", ["read", "range"])
def test_a_body_that_is_too_short_is_asked_again(store, spoilt, question):
    spoilt.short_bodies = 2
    assert QUESTIONS[question](store)
    assert spoilt.short_bodies == 0


@pytest.mark.parametrize("question", ["read", "range"])
def test_a_body_that_stays_too_short_is_an_error(store, spoilt, question):
    spoilt.short_bodies = 99
    with pytest.raises(StoreError, match="bytes, and must have"):
        QUESTIONS[question](store)


def test_a_range_is_cut_where_the_file_ends_and_no_failure(store, spoilt):
    assert store.read_range("data", len(DATA) - 5, 50) == DATA[-5:]
    assert store.read_range("data", len(DATA) + 5, 50) == b""


def test_a_server_that_does_not_know_ranges_is_refused(store, spoilt, monkeypatch):
    async def whole(self, path, **_):
        return DATA

    monkeypatch.setattr(spoilt, "_cat_file", whole)
    with pytest.raises(StoreError, match="does not serve ranges"):
        store.read_range("data", 0, 10)


def test_an_answer_that_takes_too_long_is_an_error(store, spoilt):
    spoilt.delay_s = 30.0
    with pytest.raises(StoreError, match=r"3 attempts.*TimeoutError"):
        store.read("data")


def test_larger_ranges_may_take_longer(spoilt, monkeypatch):
    monkeypatch.setattr("wsm_data.files.fsspec_store._TIMED_BYTES", 100)
    store = FsspecStore("spoilt://folder", RequestConfig(attempts=1, timeout_s=0.1))
    spoilt.delay_s = 0.25
    assert store.read_range("data", 0, 1000) == DATA[:1000]  # ten times 0.1 s
    with pytest.raises(StoreError, match="TimeoutError"):
        store.read_range("data", 0, 100)


def test_closing_ends_what_is_asked_and_what_pauses(spoilt):
    store = FsspecStore("spoilt://folder", RequestConfig(attempts=2, first_backoff_s=60.0))
    spoilt.failures = [ConnectionResetError()]
    outcomes = []

    def read():
        try:
            store.read("data")
        except StoreError as error:
            outcomes.append(str(error))

    pausing = threading.Thread(target=read)
    pausing.start()
    while spoilt.failures:
        time.sleep(0.01)
    spoilt.delay_s = 60.0
    asking = threading.Thread(target=read)
    asking.start()
    while spoilt.calls < 2:
        time.sleep(0.01)
    store.close()
    for thread in (pausing, asking):
        thread.join(timeout=120)
    assert ["was closed" in outcome for outcome in outcomes] == [True, True]
    with pytest.raises(StoreError, match="was closed"):
        store.exists("data")


def test_stores_share_no_file_system(spoilt):
    one, other = FsspecStore("spoilt://folder"), FsspecStore("spoilt://folder")
    one.close()
    assert other.read("data") == DATA


def test_a_store_crosses_a_process_boundary_as_its_name_and_settings(store):
    copy = pickle.loads(pickle.dumps(store))  # noqa: S301 - what worker processes do with it
    assert (copy.root, copy.request) == (store.root, store.request)
    assert copy.read("data") == DATA


def test_a_store_works_on_in_a_forked_process(store):
    assert store.read("data") == DATA
    context = multiprocessing.get_context("fork")
    results = context.SimpleQueue()
    child = context.Process(target=lambda: results.put(store.read("data")))
    child.start()
    child.join(timeout=120)
    assert child.exitcode == 0
    assert results.get() == DATA


@pytest.mark.parametrize(("url", "reason"), [("nosuch://x", "not known"), ("abfs://x@y/z", "nstall")])
def test_a_url_that_cannot_be_opened_is_a_wrong_request(url, reason):
    with pytest.raises(ConfigError, match=f"{url} cannot be opened: .*{reason}"):
        FsspecStore(url)


def test_what_is_listed_is_what_is_there_now():
    filesystem = MemoryFileSystem()
    filesystem.pipe_file("/listing-test/a", b"1")
    store = FsspecStore("memory://listing-test")
    try:
        assert store.names() == ["a"]
        filesystem.pipe_file("/listing-test/b", b"1")
        assert store.names() == ["a", "b"]
    finally:
        filesystem.rm("/listing-test", recursive=True)
