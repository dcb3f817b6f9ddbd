"""Who takes part in which comparison, and with which settings."""

from dataclasses import dataclass, field

LIMIT = "pread, one thread"
OURS = "wsm"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One line of the tables.

    Attributes:
        module: the contestant, a module beside this one.
        environment: name of its environment; empty for this project's own.
        options: settings of the limits and of our own loader; the modules of the peers hold theirs.
        workers: worker processes where the comparison is that of a DataLoader with two; None: takes no part in it.
        shuffled: takes part where clips are shuffled.
        as_stored: delivers the arrays as they are stored, so that each can be compared with what was written.
        note: what the page says beside it.
    """

    module: str
    environment: str = ""
    options: dict[str, object] = field(default_factory=dict)
    workers: int | None = None
    shuffled: bool = True
    as_stored: bool = True
    note: str = ""


LIMITS = {
    LIMIT: Entry(
        module="limit", options={"threads": 1, "buffer_clips": 8}, as_stored=False, note="into one buffer of a batch"
    ),
    "pread, two threads": Entry(
        module="limit", options={"threads": 2, "buffer_clips": 8}, as_stored=False, note="a buffer of a batch each"
    ),
    "pread, one clip at a time": Entry(
        module="limit",
        options={"threads": 1, "buffer_clips": 1},
        as_stored=False,
        shuffled=False,
        note="2 MB that never leave the processor's cache",
    ),
    "memcpy": Entry(
        module="limit", options={"memcpy": True}, as_stored=False, shuffled=False, note="from memory, one thread"
    ),
}

PEERS = {
    "webdataset": Entry(module="with_webdataset", workers=2),
    "Megatron-Energon": Entry(module="with_energon", environment="energon", workers=2),
    "mosaicml-streaming": Entry(module="with_streaming", environment="streaming", workers=2),
    "litdata": Entry(module="with_litdata", environment="litdata", workers=2),
}

OURS_AS_STORED = {
    OURS: Entry(module="with_wsm", workers=0, note="as stored, two threads, checksums of the first epoch"),
    "wsm, 1 thread": Entry(module="with_wsm", options={"threads": 1}),
    "wsm, no thread": Entry(module="with_wsm", options={"threads": 0}, shuffled=False),
    "wsm, verify = always": Entry(module="with_wsm", options={"verify": "always"}),
    "wsm, verify = never": Entry(module="with_wsm", options={"verify": "never"}, shuffled=False),
}
OURS_OTHERWISE = {
    "wsm, standardised": Entry(
        module="with_wsm",
        options={"standardise": True, "dtype": "float32"},
        as_stored=False,
        note="float32, four bytes for every two that are stored",
    ),
    "wsm, standardised to bfloat16": Entry(
        module="with_wsm", options={"standardise": True, "dtype": "bfloat16"}, as_stored=False, shuffled=False
    ),
}
ENTRIES = {**LIMITS, **PEERS, **OURS_AS_STORED, **OURS_OTHERWISE}
RESUMED = [*PEERS, OURS]
"""Whose time to the first batch is taken."""


def takes_part(name: str, *, shuffle: bool, processes: bool) -> bool:
    """Whether an entry is measured in a comparison; `processes`: that of a DataLoader with two workers."""
    entry = ENTRIES[name]
    if processes:
        return entry.workers is not None
    return entry.shuffled or not shuffle
