"""A stage's output folder: its record in stage.json, for one writer at a time, and what lies in it."""

import fcntl
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

from wsm_data.errors import ConfigError, IntegrityError
from wsm_data.files.atomic import is_full_disk, write_text
from wsm_data.files.digest import xxh3_128_file
from wsm_data.files.json_values import from_json
from wsm_data.files.sealed import sealed, unsealed

STAGE_FILE, LOCK_FILE = "stage.json", ".lock"


@dataclass(frozen=True, kw_only=True)
class StageRecord:
    """What stage.json holds.

    Attributes:
        name: the stage.
        version: version of the stage that wrote the folder.
        settings: every setting that decides the bytes.
        config: the whole resolved config, input paths included.
        fingerprint: digest of name, version and settings.
        inputs: fingerprint of each upstream stage, by the config field that names it.
        seen: `finished` of each upstream stage when this one was last finished, by the same names.
        units: number of units in the listing.
        workers: worker processes of the last run.
        finished: digest of the outcomes `finish` was last called with; empty before.
        outputs: xxh3_128 of every file that `finish` and the runner wrote at the end, by its name relative to the
            folder; None for a folder. One may lie beside the folder, as the scores that are installed in a release do:
            these files are compared, and never deleted.
    """

    name: str
    version: int
    settings: Mapping[str, Any]
    config: Mapping[str, Any]
    fingerprint: str
    inputs: Mapping[str, str]
    seen: Mapping[str, str]
    units: int = 0
    workers: int = 1
    finished: str = ""
    outputs: Mapping[str, str | None] = field(default_factory=dict)


def read_stage_record(folder: Path) -> StageRecord | None:
    """The record of a stage folder, or None where no stage has written yet.

    Raises:
        IntegrityError: stage.json is there but unreadable.
    """
    path = folder / STAGE_FILE
    if not path.exists():
        return None
    try:
        return from_json(StageRecord, unsealed(json.loads(path.read_text())), complete=False)
    except ValueError as error:
        raise IntegrityError(
            f"{path} is not a stage record ({error}); delete the folder and run the stage again"
        ) from error


def write_stage_record(folder: Path, record: StageRecord) -> None:
    """Write stage.json atomically."""
    write_text(folder / STAGE_FILE, json.dumps(sealed(vars(record)), indent=2, sort_keys=True) + "\n")


def size_on_disk(path: Path) -> int | None:
    """Bytes of a file; None for a folder and for what is not there."""
    return path.stat().st_size if path.is_file() else None


def digest_on_disk(path: Path) -> str | None:
    """xxh3_128 of a file; None for a folder and for what is not there."""
    return xxh3_128_file(path) if path.is_file() else None


def is_as_written(path: Path, digest: str | None) -> bool:
    """Whether an output is still there, with its bytes where their digest is known."""
    return path.exists() if digest is None else digest_on_disk(path) == digest


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder against a second writer; the lock falls with the process, however it ends.

    Raises:
        ConfigError: another process holds it, or there can be no such folder.
    """
    with _lock_file(folder) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ConfigError(
                f"{folder} is being written by another wsm process; wait for it, or use another --out"
            ) from error
        yield


def _lock_file(folder: Path) -> TextIO:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return (folder / LOCK_FILE).open("w")
    except OSError as error:
        if is_full_disk(error):  # no fault of the request
            raise
        raise ConfigError(f"{folder} must be a folder that can be written ({error}); use another --out") from error
