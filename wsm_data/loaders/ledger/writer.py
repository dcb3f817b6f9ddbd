"""The ledger of a training run: every step that a rank delivers is recorded, for `wsm audit-run`.

A record is one write to the operating system and is not flushed to disk by itself: it survives the death of the
process, and a power cut costs what the system had not written yet. The form of the files is that of `files.py`.
"""

import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wsm_data.errors import ConfigError
from wsm_data.files.differences import differences
from wsm_data.files.journal import JournalWriter
from wsm_data.files.jsonlines import canonical_json
from wsm_data.loaders.ledger.files import LEDGER_VERSION, journal_name, ledger_files, read_session


class LedgerWriter:
    """Records what one rank delivers; one writer a rank, in the process that trains.

    Args:
        folder: the ledger of the run, shared by all ranks and all restarts.
        identity: JSON of what decides the order: releases and order settings. All files of a folder have the same.
        rank: rank of this process.
        world_size: number of ranks.

    Raises:
        ConfigError: the folder is the ledger of a run with another identity.
        IntegrityError: a file of the folder is damaged at its head.
        ValueError: there is no such rank.
    """

    def __init__(self, folder: str | Path, identity: Mapping[str, object], rank: int, world_size: int):
        if not 0 <= rank < world_size:
            raise ValueError(f"rank must lie in [0, world_size = {world_size}), found {rank}")
        self._folder, self._rank = Path(folder), rank
        self._session: dict[str, Any] = {
            "version": LEDGER_VERSION,
            "session": secrets.token_hex(8),
            "identity": json.loads(canonical_json(identity)),
            "rank": rank,
            "world_size": world_size,
        }
        self._journal: JournalWriter | None = None
        self._epoch, self._next_step, self._steps = -1, 0, 0
        _require_identity(self._folder, self._session["identity"])

    def begin(self, epoch: int, step: int, steps: int) -> None:
        """Say that delivery goes on from (epoch, step): at every start and resume, and at the start of every epoch.

        What was recorded before from there on counts as lost with the run that was killed, and is trained again.

        Args:
            epoch: number of the epoch.
            step: first step that will be delivered; `steps` where the epoch was at its end.
            steps: steps the whole epoch has.
        """
        if epoch < 0 or not 0 <= step <= steps:
            raise ValueError(f"a start must be a step of 0 to {steps} in an epoch of 0 on, found epoch {epoch}, {step}")
        if self._journal is None:
            self._journal = JournalWriter(self._folder, journal_name(self._rank))
            self._journal.append(self._session)
        self._journal.append({"epoch": epoch, "start": step, "steps": steps})
        self._epoch, self._next_step, self._steps = epoch, step, steps

    def record(self, epoch: int, step: int, refs: NDArray[np.int64]) -> None:
        """Record a step that is being delivered.

        Args:
            epoch: the epoch that was begun.
            step: the step after the one before.
            refs: numbers of the clips this rank is given, in order; int64 [N], N >= 0.

        Raises:
            ValueError: it is not the next step, or the epoch was not begun.
            OSError: the record could not be written.
        """
        if self._journal is None or epoch != self._epoch or step != self._next_step or step >= self._steps:
            raise ValueError(
                f"the next step must be {self._next_step} of {self._steps} in epoch {self._epoch}, found step {step} "
                f"of epoch {epoch}; begin() says where delivery goes on"
            )
        self._journal.append({"epoch": epoch, "step": step, "refs": np.asarray(refs, np.int64).tolist()})
        self._next_step = step + 1

    def close(self) -> None:
        """Say that the process stopped of its own will, and flush the file to disk. A later `begin` opens another."""
        journal, self._journal = self._journal, None
        if journal is not None:
            journal.close({"closed": True})

    def __enter__(self) -> "LedgerWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _require_identity(folder: Path, identity: Mapping[str, Any]) -> None:
    """Refuse to mix two runs; the first file that has a head stands for all."""
    heads = (read_session(path) for path in ledger_files(folder).values())
    session = next((head for head in heads if head is not None), None)
    lines = differences(session["identity"], identity) if session is not None else []
    if lines:
        raise ConfigError(
            f"the ledger {folder} is that of a run over other sources or in another order\n  "
            + "\n  ".join(lines)
            + "\nGive each run a ledger of its own"
        )
