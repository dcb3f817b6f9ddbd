"""Where a loader stands: a few JSON fields that say what was read, in which order, and how far.

What only changes how the bytes are read (ranks, workers, threads, prefetch, the place of a release) is no part of it.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from wsm_data.errors import ConfigError
from wsm_data.files.differences import differences
from wsm_data.files.jsonlines import canonical_json
from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.sources.clips import Sources

STATE_VERSION = 1
"""Raised when the same settings would give another order."""

_POSITION = ("epoch", "step")


@dataclass(frozen=True, kw_only=True)
class LoaderState:
    """A place in the endless sequence of global steps.

    Attributes:
        sources: identity of the sources (`Sources.identity`).
        order: all settings of the order, as JSON.
        epoch: epoch of the next step.
        step: number of the next step in its epoch; as many as the epoch has steps where it is over.
        version: version of the state and of the order.
    """

    sources: tuple[Mapping[str, Any], ...]
    order: Mapping[str, Any]
    epoch: int
    step: int
    version: int = STATE_VERSION


def loader_state(sources: Sources, order: OrderConfig, *, epoch: int, step: int) -> LoaderState:
    """The state of a loader that delivers `step` of `epoch` next."""
    return LoaderState(sources=tuple(sources.identity()), order=asdict(order), epoch=epoch, step=step)


def state_to_json(state: LoaderState) -> dict[str, Any]:
    """The state as a JSON object; equal states have equal objects, before and after they were written to a file."""
    return dict(json.loads(canonical_json(asdict(state))))


def restore(record: Mapping[str, Any], expected: LoaderState) -> tuple[int, int]:
    """Epoch and step of a saved state, where it belongs to the same clips in the same order.

    Args:
        record: what `state_to_json` gave.
        expected: state of the loader that is to go on, at any place.

    Returns:
        epoch and step of the next step.

    Raises:
        ConfigError: it is no state of a loader, or was saved with other releases, selections or settings of the order;
            the message says field by field what it has and what the loader has.
    """
    wanted = state_to_json(expected)
    if lines := differences(_without_position(record), _without_position(wanted)):
        raise ConfigError(
            "a saved state can only be restored over the same sources with the same settings of the order, found\n  "
            + "\n  ".join(lines)
            + "\nGive the loader what was saved, or begin a new run without the state"
        )
    epoch, step = (_count(record, name) for name in _POSITION)
    return epoch, step


def _without_position(record: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in record.items() if name not in _POSITION}


def _count(record: Mapping[str, Any], name: str) -> int:
    value = record.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ConfigError(f"{name} of a saved state must be a number of at least 0, found {value!r}; restore the file")
    return value
