"""Epochs over a store that fails: the same bytes in the same order as from a local folder, or an error with a name."""

import hashlib
from dataclasses import replace

import pytest
from fault_proxy import Fault

from wsm_data.access.config import RemoteAccess
from wsm_data.errors import IntegrityError, StoreError
from wsm_data.loaders.config import LoaderConfig, OrderConfig, ReadConfig, SourceConfig
from wsm_data.loaders.loader import ClipLoader
from wsm_data.schema.batch import BATCH_TENSORS

GIB = 1 << 30
FOREVER = 10**9
ORDER = OrderConfig(seed=3, global_batch=4, window_blocks=2, block_clips=3)
STEPS = 6  # 24 clips, four at a time
READ = ReadConfig(dtype="float16", standardise=False)
BOTH = pytest.mark.parametrize("access", list(RemoteAccess))
HARMLESS = [fault for fault in Fault if fault not in (Fault.FORBIDDEN, Fault.HANG, Fault.STALE_LISTING)]


def step_digest(batch):
    """Everything a training step sees."""
    digest = hashlib.sha256(repr((batch.epoch, batch.step, batch.keys, batch.spans, batch.refs.tolist())).encode())
    for name in BATCH_TENSORS:
        digest.update(getattr(batch, name).contiguous().numpy().tobytes())
    return digest.hexdigest()


def run_epoch(release, read, steps):
    """Digests of the steps of an epoch, appended to a list as they come."""
    config = LoaderConfig(sources=(SourceConfig(release=release),), order=ORDER, read=read)
    with ClipLoader(config, rank=0, world_size=1) as loader:
        for batch in loader:
            steps.append(step_digest(batch))
    return steps


@pytest.fixture
def epoch(remote, published, tmp_path):
    """Reads an epoch from the URL, with a cache of three shards."""

    def run(steps, **settings):
        cache_gib = 3 * max(shard.bytes for shard in published.manifest.shards) / GIB
        read = remote.read(**{"cache_dir": str(tmp_path / "cache"), "cache_gib": cache_gib} | settings)
        return run_epoch(remote.url, replace(read, dtype=READ.dtype, standardise=READ.standardise), steps)

    return run


@pytest.fixture(scope="module")
def expected(published):
    return run_epoch(str(published.folder), READ, [])


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("fault", HARMLESS)
def test_faults_that_pass_change_nothing(epoch, expected, remote, access, fault):
    remote.proxy.spoil(r"\.tar", fault, times=1 if fault is Fault.WRONG_BYTES else 5)
    assert epoch([], access=access) == expected
    assert remote.proxy.spoiled() > 0


@BOTH
def test_all_faults_together_change_nothing(epoch, expected, remote, access):
    for fault in (Fault.SLOW_DOWN, Fault.RESET, Fault.CUT_BODY, Fault.SHORT_BODY, Fault.WRONG_BYTES, Fault.HANG):
        remote.proxy.spoil(r"\.tar", fault)
    assert epoch([], access=access, request_timeout_s=2.0) == expected
    assert remote.proxy.spoiled() == 6


@BOTH
@pytest.mark.parametrize(
    "fault",
    [
        Fault.FORBIDDEN,
        *(pytest.param(fault, marks=pytest.mark.slow) for fault in HARMLESS[:5] if fault is not Fault.TRICKLE),
    ],
)
def test_a_fault_that_lasts_ends_the_epoch_with_the_name_of_the_object(
    epoch, expected, remote, published, access, fault
):
    bad, steps = published.manifest.shards[-1].name, []
    remote.proxy.spoil(bad, fault, FOREVER)
    with pytest.raises(StoreError, match=f"{remote.url}/{bad}"):
        epoch(steps, access=access, attempts=2)
    assert steps == expected[: len(steps)]
    assert len(steps) < len(expected)


@BOTH
def test_bytes_that_stay_wrong_end_the_epoch_with_the_name_of_the_shard(epoch, expected, remote, published, access):
    bad, steps = published.manifest.shards[-1].name, []
    remote.proxy.spoil(bad, Fault.WRONG_BYTES, FOREVER)
    with pytest.raises(IntegrityError, match=bad):
        epoch(steps, access=access)
    assert steps == expected[: len(steps)]


def test_wrong_bytes_of_a_later_epoch_are_noticed_where_nothing_is_kept(remote, published):
    """Every ranged read is a new transfer, so `verify = first`, the default, compares it each time."""
    config = LoaderConfig(sources=(SourceConfig(release=remote.url),), order=ORDER, read=remote.read())
    with ClipLoader(config, rank=0, world_size=1) as loader:
        assert len(list(loader)) == STEPS
        bad = published.manifest.shards[-1].name
        remote.proxy.spoil(bad, Fault.WRONG_BYTES, FOREVER)
        with pytest.raises(IntegrityError, match=bad):
            list(loader)


@BOTH
def test_an_epoch_is_that_of_the_local_folder_and_asks_for_no_listing_that_could_be_stale(
    epoch, expected, remote, access
):
    remote.proxy.spoil(r"list-type|prefix=|delimiter=", Fault.STALE_LISTING, FOREVER)
    assert epoch([], access=access) == expected
    assert remote.proxy.requests(r"list-type|prefix=|delimiter=") == []


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize("settings", [{"threads": 0}, {"threads": 4, "fetch_threads": 1}], ids=str)
def test_threads_change_nothing(epoch, expected, access, settings):
    assert epoch([], access=access, **settings) == expected


@pytest.mark.slow
def test_a_second_epoch_from_the_cache_asks_for_no_shard(epoch, expected, remote, published):
    everything = {"cache_gib": 2 * sum(shard.bytes for shard in published.manifest.shards) / GIB}
    assert epoch([], access=RemoteAccess.SHARDS, **everything) == expected
    before = len(remote.proxy.requests(r"\.tar"))
    assert epoch([], access=RemoteAccess.SHARDS, **everything) == expected
    assert len(remote.proxy.requests(r"\.tar")) == before


def test_the_steps_differ_so_that_an_order_can_be_seen(expected):
    assert len(set(expected)) == len(expected) == STEPS
