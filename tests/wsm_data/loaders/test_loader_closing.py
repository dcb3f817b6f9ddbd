"""Closing a loader: nobody waits for a store that hangs, and what was closed is opened again by the next iterator."""

import itertools
import signal
import threading
import time
from contextlib import ExitStack

import pytest
from fault_proxy import Fault

from wsm_data.access.config import RemoteAccess
from wsm_data.errors import StoreError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.queries import QueryLoader
from wsm_data.loaders.sources.queries import QueryConfig

pytestmark = pytest.mark.timeout(300)  # far below the time that the store below is given to answer
FOREVER = 10**9
PATIENT = {"request_timeout_s": 3600.0, "attempts": 1000}
BOTH = pytest.mark.parametrize("access", list(RemoteAccess))


@pytest.fixture
def open_loader(remote, address, tmp_path):
    """Opens loaders behind the proxy, in the order of the index, and closes them at the end."""
    with ExitStack() as stack:

        def make(make_one=ClipLoader, **settings):
            config = LoaderConfig(
                sources=(SourceConfig(release=address),),
                order=OrderConfig(shuffle=False, global_batch=4),
                read=remote.read(**{"cache_dir": str(tmp_path / "cache"), "threads": 2} | settings),
            )
            return stack.enter_context(make_one(config))

        yield make


def query_loader(config):
    return QueryLoader(config, QueryConfig(future_latents=1))


def keys_of(batches):
    return [(getattr(batch, "history", batch)).keys for batch in batches]


def own_threads():
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("wsm-")]


def wait_until_asked(remote):
    until = time.monotonic() + 120
    while not remote.proxy.spoiled():
        assert time.monotonic() < until
        time.sleep(0.01)


@BOTH
@pytest.mark.parametrize("make_one", [ClipLoader, query_loader])
@pytest.mark.parametrize("threads", [0, 2])
def test_a_closed_loader_goes_on_over_a_url(open_loader, access, make_one, threads):
    with open_loader(make_one, access=access) as loader:
        expected = keys_of(loader)
    loader = open_loader(make_one, access=access, threads=threads)
    found = keys_of(itertools.islice(loader, 2))
    loader.close()
    assert own_threads() == []
    assert found + keys_of(loader) == expected


@BOTH
@pytest.mark.parametrize("make_one", [ClipLoader, query_loader])
@pytest.mark.parametrize("way", ["close", "break", "set_epoch"])
def test_leaving_does_not_wait_for_a_store_that_hangs(open_loader, remote, published, access, make_one, way):
    remote.proxy.spoil(published.manifest.shards[-1].name, Fault.HANG, FOREVER)
    loader = open_loader(make_one, access=access, prefetch_batches=9, **PATIENT)
    iterator = iter(loader)
    next(iterator)
    wait_until_asked(remote)
    if way == "break":
        del iterator
    else:
        getattr(loader, way)(*([7] if way == "set_epoch" else []))
    assert own_threads() == []


@BOTH
def test_an_interrupt_does_not_wait_for_a_store_that_hangs(open_loader, remote, access):
    remote.proxy.spoil(r"\.tar", Fault.HANG, FOREVER)
    loader = open_loader(access=access, **PATIENT)

    def interrupt():
        wait_until_asked(remote)
        time.sleep(0.2)  # the main thread waits for the first batch by now
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

    interrupting = threading.Thread(target=interrupt)
    interrupting.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            next(iter(loader))
    finally:
        interrupting.join()
    assert own_threads() == []
    assert loader.state_dict()["step"] == 0


@BOTH
def test_an_error_of_a_step_does_not_wait_for_those_behind_it(open_loader, remote, published, access):
    first, *_, last = (shard.name for shard in published.manifest.shards)
    remote.proxy.spoil(first, Fault.FORBIDDEN, FOREVER)
    remote.proxy.spoil(last, Fault.HANG, FOREVER)
    loader = open_loader(access=access, prefetch_batches=9, **PATIENT)
    with pytest.raises(StoreError, match=first):
        next(iter(loader))
    assert own_threads() == []
