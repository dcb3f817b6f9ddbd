"""What a loader holds does not grow: memory, open files, threads."""

import gc
import subprocess
import sys
import threading
from functools import partial
from pathlib import Path

import pytest

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.batches.buffers import BufferPool
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.loaders.reading import step_reader

WARM_UP_EPOCHS, EPOCHS = 5, 20
TOLERANCE_BYTES = 6 << 20
"""Arenas of the allocator and caches of Python come and go by a few MB; a batch left behind every epoch, of 0.4 MB or
more, would make 8 MB and more in 20 epochs of 6 steps."""


def _resident_bytes() -> int:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


def _open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def _threads() -> int:
    return len(list(Path("/proc/self/task").iterdir()))


def _epochs(loader: ClipLoader, count: int) -> None:
    for _ in range(count):
        for batch in loader:
            assert batch.keys


@pytest.mark.parametrize("settings", [{"threads": 0}, {"threads": 2}, {"threads": 2, "max_latents": 3}], ids=str)
def test_memory_files_and_threads_are_constant_over_20_epochs(make_loader, settings):
    loader = make_loader(verify="always", **settings)
    _epochs(loader, WARM_UP_EPOCHS)
    memory, files, threads = _resident_bytes(), _open_files(), _threads()
    _epochs(loader, EPOCHS)
    assert _resident_bytes() - memory < TOLERANCE_BYTES
    assert (_open_files(), _threads()) == (files, threads)


@pytest.fixture
def url(released):
    """The release behind a server that runs in a process of its own, so that nothing of it is counted here."""
    command = [sys.executable, str(Path(__file__).parents[1] / "fakes" / "folder_server.py"), str(released.folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield server.stdout.readline().strip()
        finally:
            server.kill()


@pytest.mark.timeout(120)
@pytest.mark.parametrize("access", list(RemoteAccess))
def test_memory_files_and_threads_are_constant_over_20_epochs_from_a_store(released, url, tmp_path, access):
    """With a cache of two and a half shards, so that every epoch downloads and removes some."""
    largest = max(shard.bytes for shard in released.release.manifest.shards)
    read = ReadConfig(
        access=access, threads=2, fetch_threads=2, cache_dir=str(tmp_path / "cache"), cache_gib=2.5 * largest / 2**30
    )
    order = OrderConfig(seed=3, global_batch=4, window_blocks=2)
    config = LoaderConfig(sources=(SourceConfig(release=url),), order=order, read=read)
    with ClipLoader(config) as loader:
        _epochs(loader, WARM_UP_EPOCHS)
        memory, files, threads = _resident_bytes(), _open_files(), _threads()
        _epochs(loader, EPOCHS)
        assert _resident_bytes() - memory < TOLERANCE_BYTES
        # Threads that fetch, and a connection for each, are made when all others are busy: at most so many more.
        assert _open_files() <= files + read.fetch_threads
        assert _threads() <= threads + read.fetch_threads


def test_epochs_that_are_broken_off_leave_nothing_behind(make_loader):
    loader = make_loader(threads=2, prefetch_batches=3)

    def broken_off(count: int) -> None:
        for _ in range(count):
            for batch in loader:
                if batch.step == 2:
                    break
            loader.set_epoch(loader.state_dict()["epoch"] + 1)

    broken_off(WARM_UP_EPOCHS)
    memory, files, threads = _resident_bytes(), _open_files(), threading.active_count()
    broken_off(EPOCHS)
    assert _resident_bytes() - memory < TOLERANCE_BYTES
    assert (_open_files(), threading.active_count()) == (files, threads)


def test_few_blocks_serve_all_batches(make_loader, monkeypatch):
    """One the caller holds, and those that are read ahead."""
    patient = partial(BufferPool, patience_s=5.0)  # a busy machine may take long over a moment
    monkeypatch.setattr(step_reader, "BufferPool", patient)
    loader = make_loader(threads=1, prefetch_batches=2, standardise=False, dtype="float16")
    _epochs(loader, 1)
    places = set()
    for _ in range(6):
        for batch in loader:
            places.add(batch.rgb.data_ptr())
    del batch
    assert len(places) <= 3
