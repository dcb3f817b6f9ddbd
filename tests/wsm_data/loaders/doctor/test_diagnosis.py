"""What the doctor says: each bottleneck is named, with the setting that changes it, and healthy loaders are let go."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.config import Arrangement, OrderConfig, ReadConfig, Verify
from wsm_data.loaders.doctor.diagnosis import LoaderRun, SourceFacts, cautions, diagnose
from wsm_data.loaders.timing import Part

ELAPSED_S = 10.0


def run(*, remote=False, step_s=0.0, limit_mb=5000.0, megabytes=10_000.0, **shares):
    """A run of ten seconds whose parts took these shares of the time that two readers had; `wait` of its own."""
    seconds = {part: 2 * ELAPSED_S * shares.get(part.value, 0.0) for part in Part}
    seconds[Part.WAIT] = ELAPSED_S * shares.get("wait", 0.99)
    return LoaderRun(
        clips=1000,
        stored_bytes=int(megabytes * 1e6),
        elapsed_s=ELAPSED_S,
        first_batch_s=0.02,
        seconds=seconds,
        step_s=step_s,
        limit_bytes_per_s=limit_mb * 1e6,
        remote=remote,
    )


CASES = {
    "ranges of a store": (
        run(remote=True, store=0.93, collate=0.05, megabytes=3100),
        ReadConfig(fetch_threads=8),
        ["The store gives 310 MB/s", "93%", "read.fetch_threads above 8", "read.access=shards"],
    ),
    "shards of a store": (
        run(remote=True, store=0.8, megabytes=3100),
        ReadConfig(access=RemoteAccess.SHARDS, cache_dir="cache", cache_gib=20),
        ["The store gives 310 MB/s", "80%", "read.cache_gib=20"],
    ),
    "a disk at the limit of one thread": (
        run(store=0.9, megabytes=45_000),
        ReadConfig(threads=2),
        ["The store gives 4,500 MB/s", "5,000 MB/s", "as fast as this machine reads"],
    ),
    "a slow disk": (
        run(store=0.9, megabytes=2000),
        ReadConfig(threads=2),
        ["The store gives 200 MB/s", "the disk or the processors", "read.threads above 2"],
    ),
    "checksums of every read": (
        run(checksum=0.6, store=0.3),
        ReadConfig(verify=Verify.ALWAYS),
        ["Checksums take 60%", "read.verify=first"],
    ),
    "checksums of first reads": (
        run(checksum=0.6, store=0.3),
        ReadConfig(),
        ["Checksums take 60%", "it passes once each clip of a local release has been read"],
    ),
    "standardising to float32": (
        run(collate=0.7, store=0.2),
        ReadConfig(),
        ["Making batches takes 70%", "float32", "read.dtype=bfloat16", "read.device=cuda"],
    ),
    "putting batches together": (
        run(collate=0.7, store=0.2),
        ReadConfig(standardise=False, dtype="float16", threads=2),
        ["Making batches takes 70%", "read.threads above 2"],
    ),
    "copies from pageable memory": (
        run(transfer=0.5, store=0.4),
        ReadConfig(device="cuda"),
        ["Copying to cuda takes 50%", "read.pin_memory=true"],
    ),
    "copies from page-locked memory": (
        run(transfer=0.5, store=0.4),
        ReadConfig(device="cuda", pin_memory=True),
        ["Copying to cuda takes 50%", "bound by the bus"],
    ),
    "no room to read ahead": (
        run(store=0.1, collate=0.05),
        ReadConfig(prefetch_batches=1),
        ["No part is busy", "85%", "read.prefetch_batches above 1"],
    ),
    "the training step": (
        run(step_s=0.3, wait=0.01, store=0.9),
        ReadConfig(),
        ["The consumer sets the pace", "1%", "nothing to change"],
    ),
    "a training step that waits": (
        run(step_s=0.3, wait=0.4, remote=True, store=0.9, megabytes=3100),
        ReadConfig(),
        ["The store gives 310 MB/s", "read.fetch_threads"],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_the_bottleneck_is_named_with_what_to_change(case):
    measured, read, words = CASES[case]
    sentence = diagnose(measured, read)
    assert [word for word in words if word not in sentence] == []


@pytest.mark.parametrize("case", CASES)
def test_the_diagnosis_is_one_sentence(case):
    measured, read, _ = CASES[case]
    assert re.findall(r"\.(?:\s|$)", diagnose(measured, read)) == ["."]


shares = st.floats(0.0, 1.0)


@given(
    shares=st.fixed_dictionaries({part.value: shares for part in Part}),
    remote=st.booleans(),
    step_s=st.sampled_from([0.0, 0.2]),
    read=st.builds(
        ReadConfig,
        threads=st.integers(0, 4),
        verify=st.sampled_from(Verify),
        access=st.sampled_from(RemoteAccess),
        standardise=st.booleans(),
        dtype=st.sampled_from(["float16", "float32"]),
    ),
)
def test_whatever_was_measured_there_is_a_sentence(shares, remote, step_s, read):
    assert diagnose(run(remote=remote, step_s=step_s, **shares), read).endswith(".")


def facts(**changes):
    healthy = {"shards": 200, "shard_bytes": 200 * 512_000_000, "padding_share": 0.02, "longest_latents": 60}
    return SourceFacts(**{**healthy, "remote": False} | changes)


def test_a_healthy_release_needs_no_warning():
    assert cautions(facts(), OrderConfig(global_batch=64)) == []


@pytest.mark.parametrize(
    ("found", "order", "words"),
    [
        (facts(shards=6, shard_bytes=6 * 512_000_000), OrderConfig(global_batch=64), ["too few", "6 shards", "64"]),
        (
            facts(shards=2000, shard_bytes=2000 * 2_000_000, remote=True),
            OrderConfig(),
            ["small shards", "2000", "2.0 MB"],
        ),
        (facts(padding_share=0.41), OrderConfig(), ["padding: 41%", "arrangement=bucket", "row_latents=60"]),
        (facts(padding_share=0.41), OrderConfig(arrangement=Arrangement.BUCKET), ["padding: 41%", "try order.arr"]),
    ],
)
def test_what_does_not_suit_the_order_is_said_with_its_numbers(found, order, words):
    [caution] = cautions(found, order)
    assert [word for word in words if word not in caution] == []


def test_few_small_shards_of_a_local_release_are_no_cause_for_alarm():
    assert cautions(facts(shards=3, shard_bytes=3_000_000), OrderConfig(global_batch=64)) == []


def test_clips_that_are_joined_already_are_not_told_to_be_joined():
    order = OrderConfig(arrangement=Arrangement.JOIN, row_latents=64)
    assert cautions(facts(padding_share=0.41), order) == []
