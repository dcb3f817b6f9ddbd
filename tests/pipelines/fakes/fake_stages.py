"""Stages small enough to see through. A worker process imports this module by name, so it stands alone on sys.path.

Every unit is a file of the source folder. What stands in it says how the unit behaves.
"""

import errno
import json
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

from pipelines.running.stage import Finished, Outcome, Reads, Settled, Stage, StageContext, Unit
from pipelines.running.upstream import done_outcomes, require_stage
from wsm_data.errors import DataError, Reason
from wsm_data.files.atomic import write_bytes, write_text
from wsm_data.files.digest import sha256_bytes
from wsm_data.files.typed_toml import INPUT, SPEED
from wsm_data.schema.verdict import Refusal

CALLS = "calls.txt"
"""What a stage did, a line each, in the source's parent folder: units by id, and `finish`."""


class Letters(StrEnum):
    AS_THEY_ARE = "as_they_are"
    UPPER = "upper"


@dataclass(frozen=True, kw_only=True)
class CopyConfig:
    source: Path = field(metadata=INPUT)
    letters: Letters = Letters.AS_THEY_ARE
    repeat: int = 1
    batched: bool = field(default=False, metadata=SPEED)
    pause_s: float = field(default=0.0, metadata=SPEED)


@dataclass(frozen=True, kw_only=True)
class JoinConfig:
    copy: Path = field(metadata=INPUT)


def note(source: Path, text: str) -> None:
    with (source.parent / CALLS).open("a") as file:
        file.write(text + "\n")


def list_copies(config: CopyConfig) -> Sequence[Unit]:
    files = sorted(path for path in config.source.iterdir() if path.suffix == ".txt")
    return [
        Unit(
            id=path.stem,
            source=path.name,
            inputs={"file": sha256_bytes(path.read_bytes())},
            batch=path.stem[0] if config.batched else "",
            payload=path.name,
        )
        for path in files
    ]


def copy(batch: Sequence[Unit], config: CopyConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        note(config.source, unit.id)
        time.sleep(config.pause_s)
        text = (config.source / unit.payload).read_text()
        behave(text, unit.id)
        if text == "forgotten":
            continue
        if text == "interrupted":
            raise KeyboardInterrupt
        yield copied(unit, text, config, context.out)
        if text == "given twice":
            yield copied(unit, text, config, context.out)


def behave(text: str, unit: str) -> None:
    match text:
        case "bad":
            raise DataError(Reason.FRAME_EMPTY, f"{unit} is bad", {"bytes": 0})
        case "bug":
            raise ValueError(f"a bug in {unit}")
        case "dies":
            os._exit(7)
        case "disk full":
            raise OSError(errno.ENOSPC, "No space left on device")
        case "no permission":
            raise PermissionError(errno.EACCES, "Permission denied")


def copied(unit: Unit, text: str, config: CopyConfig, out: Path) -> Outcome:
    data = (text.upper() if config.letters is Letters.UPPER else text).encode() * config.repeat
    write_bytes(out / "copies" / f"{unit.id}.txt", data)
    facts: dict[str, object] = {"bytes": len(data), "words": tuple(text.split()), "pid": os.getpid()}
    if text == "does not pickle":
        facts["bytes"] = lambda: None
    part = Refusal(unit=f"{unit.id}/part", source=unit.source, reason=Reason.FRAME_MISSING, message="one frame")
    return Outcome(
        unit=unit.id,
        digest=sha256_bytes(data),
        outputs=(f"copies/{unit.id}.txt",),
        facts=facts,
        refusals=(part,) if text == "partly bad" else (),
    )


def finish_copies(config: CopyConfig, context: StageContext, settled: Settled) -> Finished:
    note(config.source, "finish")
    words = {unit: outcome.facts.get("words") for unit, outcome in settled.outcomes.items()}
    write_text(context.out / "words.json", json.dumps({"words": words, "pending": settled.pending}) + repr(words))
    if (config.source / "finish dies").exists():
        os._exit(7)
    twins = [
        Refusal(unit="twin", source="", reason=Reason.EPISODE_DUPLICATE, message="found twice")
        for _ in config.source.glob("twin")
    ]
    return Finished(refusals=tuple(twins), outputs=("words.json",))


def list_joins(config: JoinConfig) -> Sequence[Unit]:
    require_stage(config.copy, "copy")
    return [Unit(id=name, inputs={"copy": one.digest}) for name, one in done_outcomes(config.copy).items()]


def join(batch: Sequence[Unit], config: JoinConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        write_bytes(context.out / unit.id, (config.copy / "copies" / f"{unit.id}.txt").read_bytes() + b"!")
        yield Outcome(unit=unit.id, digest=unit.inputs["copy"], outputs=(unit.id,))


COPY = Stage(name="copy", version=1, config_type=CopyConfig, list_units=list_copies, process=copy, finish=finish_copies)
COPY_VERSION_2 = replace(COPY, version=2)


def join_reads(config: JoinConfig, units: Sequence[Unit]) -> Reads:
    return {config.copy: {unit.id: (f"copies/{unit.id}.txt",) for unit in units}}


JOIN = Stage(name="join", version=1, config_type=JoinConfig, list_units=list_joins, process=join, reads=join_reads)


class CopyModule:
    STAGE = COPY


class JoinModule:
    STAGE = JOIN
