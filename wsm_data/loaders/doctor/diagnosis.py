"""What a loader's measured times mean: the one thing that holds it up, and what to change about it."""

from collections.abc import Mapping
from dataclasses import dataclass

from wsm_data.access.config import RemoteAccess
from wsm_data.loaders.config import Arrangement, OrderConfig, ReadConfig, Verify
from wsm_data.loaders.timing import Part

KEEPS_UP_SHARE = 0.05
"""A training step that waits for less than this share of its time is not held up by its loader."""

AT_THE_LIMIT_SHARE = 0.8
"""A local store that gives this share of what one thread reads of the same bytes afterwards is as fast as it gets."""

IDLE_SHARE = 0.2
"""Where no part takes this share of the readers' time, they have nothing to do."""

SMALL_SHARD_BYTES = 64e6
HIGH_PADDING_SHARE = 0.15


@dataclass(frozen=True, kw_only=True)
class LoaderRun:
    """What was measured of a loader, after its first batch.

    Attributes:
        clips: clips that were delivered.
        stored_bytes: bytes that these clips take in their shards.
        elapsed_s: time that passed, s.
        first_batch_s: time from opening the loader to its first batch, s.
        seconds: time by part, added up over all threads, s.
        step_s: time that the consumer took for each batch, s; 0: it only took batches.
        limit_bytes_per_s: rate at which the bytes of the same clips were read again afterwards, one clip after the
            other into one buffer.
        remote: the release is behind a URL.
    """

    clips: int
    stored_bytes: int
    elapsed_s: float
    first_batch_s: float
    seconds: Mapping[Part, float]
    step_s: float
    limit_bytes_per_s: float
    remote: bool

    @property
    def bytes_per_s(self) -> float:
        """Stored bytes delivered in a second."""
        return self.stored_bytes / self.elapsed_s


@dataclass(frozen=True, kw_only=True)
class SourceFacts:
    """What decides whether a release suits a loader.

    Attributes:
        shards: shards that hold clips of the sources.
        shard_bytes: their size, all together.
        padding_share: latents of an epoch that are padding, 0 to 1.
        longest_latents: latents of the longest sequence.
        remote: a release is behind a URL.
    """

    shards: int
    shard_bytes: int
    padding_share: float
    longest_latents: int
    remote: bool


def readers(read: ReadConfig) -> int:
    """Threads that read at the same time."""
    return max(1, read.threads)


def diagnose(run: LoaderRun, read: ReadConfig) -> str:
    """Name the bottleneck in one sentence, and what to change.

    Args:
        run: what was measured.
        read: the settings it was measured with.
    """
    waited = run.seconds[Part.WAIT] / run.elapsed_s
    if run.step_s and waited < KEEPS_UP_SHARE:
        return (
            f"The consumer sets the pace: it waited for batches in {waited:.0%} of the {run.elapsed_s:.1f} s, so there "
            "is nothing to change in the loader."
        )
    work = {part: seconds for part, seconds in run.seconds.items() if part is not Part.WAIT}
    busy_share = sum(work.values()) / (readers(read) * run.elapsed_s)
    part = max(work, key=lambda one: work[one])
    share = work[part] / (readers(read) * run.elapsed_s)
    if not run.step_s and share < IDLE_SHARE and read.threads:
        return (
            f"No part is busy: the {readers(read)} readers rest for {1 - busy_share:.0%} of their time, as there is no "
            f"room to read ahead; raise read.prefetch_batches above {read.prefetch_batches}."
        )
    sentence = {
        Part.STORE: _of_remote_store if run.remote else _of_local_store,
        Part.CHECKSUM: _of_checksums,
        Part.COLLATE: _of_collating,
        Part.TRANSFER: _of_transfer,
    }[part]
    return sentence(run, read, share)


def _of_remote_store(run: LoaderRun, read: ReadConfig, share: float) -> str:
    found = f"The store gives {_rate(run.bytes_per_s)} and is waited for in {share:.0%} of the readers' time"
    more = f"raise read.fetch_threads above {read.fetch_threads}"
    if read.access is RemoteAccess.RANGES:
        return f"{found}: {more}, or set read.access=shards with a read.cache_dir, so that a second epoch is local."
    return f"{found}: {more}; shards that stay in the cache (read.cache_gib={read.cache_gib:g}) are not fetched again."


def _of_local_store(run: LoaderRun, read: ReadConfig, share: float) -> str:
    found = f"The store gives {_rate(run.bytes_per_s)} and is busy {share:.0%} of the readers' time"
    limit = f"one thread alone reads the same bytes at {_rate(run.limit_bytes_per_s)}"
    if run.bytes_per_s >= AT_THE_LIMIT_SHARE * run.limit_bytes_per_s:
        return (
            f"{found}; {limit}, so this is about as fast as this machine reads, and only {_more(read)} is left to try."
        )
    return (
        f"{found}, though {limit} once they are in memory: the disk or the processors are the bottleneck, so try "
        f"{_more(read)}, a faster disk, or memory that holds the release."
    )


def _of_checksums(_: LoaderRun, read: ReadConfig, share: float) -> str:
    found = f"Checksums take {share:.0%} of the readers' time"
    if read.verify is Verify.ALWAYS:
        return f"{found}: with read.verify=first each clip is checked once in a process, or try {_more(read)}."
    return (
        f"{found}: with read.verify=first it passes once each clip of a local release has been read, while what comes "
        f"from a URL in ranges is always compared; or try {_more(read)}."
    )


def _of_collating(_: LoaderRun, read: ReadConfig, share: float) -> str:
    found = f"Making batches takes {share:.0%} of the readers' time"
    if read.standardise and read.dtype == "float32":
        return (
            f"{found}, most of it to standardise to float32: read.dtype=bfloat16 writes half as much, on a GPU "
            f"(read.device=cuda) it is done there, or try {_more(read)}."
        )
    return f"{found}: try {_more(read)}."


def _of_transfer(_: LoaderRun, read: ReadConfig, share: float) -> str:
    change = (
        "it is bound by the bus" if read.pin_memory else "set read.pin_memory=true, so that it runs beside the step"
    )
    return f"Copying to {read.device} takes {share:.0%} of the readers' time: {change}."


def _more(read: ReadConfig) -> str:
    return f"read.threads above {read.threads}"


def _rate(bytes_per_s: float) -> str:
    return f"{bytes_per_s / 1e6:,.0f} MB/s"


def cautions(facts: SourceFacts, order: OrderConfig) -> list[str]:
    """What about the release does not suit the order, with what to do about it; empty where all is well."""
    found = []
    mean_bytes = facts.shard_bytes / max(facts.shards, 1)
    small = mean_bytes < SMALL_SHARD_BYTES
    if facts.shards < order.global_batch and not small:
        found.append(
            f"too few shards: the {order.global_batch} rows of a step come from {order.global_batch} stretches of the "
            f"order, but there are {facts.shards} shards of {mean_bytes / 1e6:,.0f} MB, so ranks read the same ones; "
            f"pack with smaller shards, so that there are at least {order.global_batch}"
        )
    if small and facts.remote and facts.shards > 1:
        found.append(
            f"small shards: the {facts.shards} shards have {mean_bytes / 1e6:.1f} MB on average, and each costs "
            "requests of its own; pack with shards of 256 to 512 MB"
        )
    if facts.padding_share > HIGH_PADDING_SHARE and order.arrangement is not Arrangement.JOIN:
        bucket = "" if order.arrangement is Arrangement.BUCKET else "order.arrangement=bucket, or "
        found.append(
            f"padding: {facts.padding_share:.0%} of the latents of an epoch are padding; try {bucket}"
            f"order.arrangement=join with order.row_latents={facts.longest_latents} or more"
        )
    return found
