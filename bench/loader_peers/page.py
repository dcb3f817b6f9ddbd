"""The page that a person reads: tables of clips per second and ratios, of memory, and of times to the first batch."""

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from reporting import machine_line, table

from loader_peers.entries import ENTRIES, LIMITS, OURS, PEERS

INTRODUCTION = """\
{clips} clips of {megabytes:.2f} MB in batches of {batch_clips}, as they are stored, page cache warm; medians of
{rounds} interleaved rounds, with the lowest and the highest in brackets. A round is as many epochs as
fill a second. Ratios are taken within a round, and say how much faster `wsm` is. Every array of every clip that a
contestant delivers as stored was compared with what was written. torch has one thread in all of them."""

WORKERS = """\
Workers are started before the first round and persist. `wsm` is the same loader in the training process, with its two
threads: what a user has in place of workers."""

MEMORY = """\
Growth of resident memory since the imports, the largest seen between batches of an epoch, in one process, not shuffled.
One batch of {batch_megabytes:.1f} MB is in the consumer's hands. Mapped files are pages of the page cache that the
process has touched."""

FIRST = """\
Time from a process that has imported everything to the first batch, shuffled: the loader is opened, and nothing of it
has been used before. Resumed: the same after {steps} batches of an epoch, with the state from the process that
delivered them; what follows is compared, in order, with what that process delivered then. webdataset keeps no state:
what was delivered is read again and thrown away."""

KNOWN = """\
Not of this run: according to the notes that this project was begun with, the public loader of the raw set, InternNav's
NavDP dataset, takes 0.2 to 2.9 s for an item (median 0.72 s). No script here measures it."""


def page(record: Mapping[str, Any]) -> list[str]:
    """The page, line by line."""
    rates = record["clips_per_s"]
    facts = {
        **record,
        "megabytes": record["clip_bytes"] / 1e6,
        "batch_megabytes": record["clip_bytes"] * record["batch_clips"] / 1e6,
        "rounds": len(next(iter(next(iter(rates.values())).values()))),
        "steps": record["steps_before_resuming"],
    }
    lines = ["# Loaders", "", *_paragraph(INTRODUCTION, facts)]
    for comparison, of_entries in rates.items():
        if comparison == "DataLoader with 2 workers":
            lines += ["", *_paragraph(WORKERS, facts)]
        lines += ["", f"## {comparison[0].upper()}{comparison[1:]}", "", *_rates(of_entries, record["clip_bytes"])]
        lines += ["", _goals(of_entries)]
    lines += ["", "## Memory, MB", "", *_paragraph(MEMORY, facts), "", *_memory(record["memory_mb"])]
    lines += ["", "## First batch", "", *_paragraph(FIRST, facts), ""]
    lines += [*_first(record["first_batch_s"], record["resumed"]), "", *_paragraph(KNOWN, facts)]
    return [*lines, "", machine_line(record["machine"])]


def _paragraph(text: str, facts: Mapping[str, Any]) -> list[str]:
    return text.format(**facts).splitlines()


def spread(values: Sequence[float], digits: int = 0) -> str:
    """Median, lowest and highest."""
    middle, low, high = (f"{value:,.{digits}f}" for value in (statistics.median(values), min(values), max(values)))
    return f"{middle} ({low} to {high})"


def ratios(numerators: Sequence[float], denominators: Sequence[float]) -> list[float]:
    return [above / below for above, below in zip(numerators, denominators, strict=True)]


def _rates(of_entries: Mapping[str, Sequence[float]], clip_bytes: int) -> list[str]:
    ours = of_entries[OURS]
    rows = []
    for name, rates in of_entries.items():
        note = f": {ENTRIES[name].note}" if ENTRIES[name].note else ""
        megabytes = statistics.median(rates) * clip_bytes / 1e6
        ratio = "" if name == OURS else spread(ratios(ours, rates), 2)
        rows.append([f"{name}{note}", spread(rates), f"{megabytes:,.0f}", ratio])
    return table(["contestant", "clips/s", "MB/s", "wsm is faster by"], rows)


def _goals(of_entries: Mapping[str, Sequence[float]]) -> str:
    """Our rate against the limit and the best neighbour, in a sentence."""
    peers = {name: rates for name, rates in of_entries.items() if name in PEERS}
    best = max(peers, key=lambda name: statistics.median(peers[name]))
    against_best = f"{spread(ratios(of_entries[OURS], peers[best]), 2)} of {best}, the fastest neighbour here"
    limits = [
        f"{spread(ratios(of_entries[OURS], of_entries[limit]), 2)} of {limit}"
        for limit in LIMITS
        if limit in of_entries
    ]
    return f"wsm reaches {', '.join([*limits, against_best])}."


def _memory(of_entries: Mapping[str, Mapping[str, float]]) -> list[str]:
    rows = [
        [name, *(f"{memory[kind]:.0f}" for kind in ("RssAnon", "RssFile", "RssShmem"))]
        for name, memory in of_entries.items()
    ]
    return table(["contestant", "own", "mapped files", "shared memory"], rows)


def _first(seconds: Mapping[str, Sequence[float]], resumed: Mapping[str, Any]) -> list[str]:
    rows = []
    for name, times in seconds.items():
        again = resumed[name]
        rows.append([name, _milliseconds(times), _milliseconds(again["seconds"]), _continued(again["continued"])])
    return table(["contestant", "first batch, ms", "first batch resumed, ms", "rest of the epoch"], rows)


def _milliseconds(seconds: Sequence[float]) -> str:
    return spread([1000 * value for value in seconds])


def _continued(found: Mapping[str, Any]) -> str:
    if found["exact"]:
        return "exact"
    return f"{found['lost']} clips lost, {found['repeated']} repeated, order changed"
