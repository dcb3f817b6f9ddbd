"""What is not in a release: refusals by reason, and the frame that one of them speaks of."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from wsm_data.errors import ConfigError
from wsm_data.files.json_values import to_json
from wsm_data.files.typed_toml import did_you_mean
from wsm_data.view.browser.named_image import named_image

_FRAME_NAMES = ("frame", "first_frame", "worst_step")
_FRAME_IN_TEXT = re.compile(r"\bframe (\d{1,6})\b")


class Refusals:
    """The lines of a quarantine, by number."""

    def __init__(self, lines: Sequence[Mapping[str, object]]) -> None:
        self._lines = lines

    def __len__(self) -> int:
        return len(self._lines)

    def line(self, number: int) -> Mapping[str, object]:
        """One refusal.

        Raises:
            ConfigError: there are fewer.
        """
        if number >= len(self._lines):
            raise ConfigError(f"there is no refusal {number}; there are {len(self._lines)}, from 0")
        return self._lines[number]

    def reasons(self) -> list[tuple[str, int]]:
        """Reason codes and how often each occurs, the most frequent first."""
        counts = Counter(str(line["reason"]) for line in self._lines)
        return sorted(counts.items(), key=lambda item: (-item[1], item[0]))

    def listed(self, *, reason: str, text: str, offset: int, limit: int) -> dict[str, Any]:
        """Some refusals, with their numbers and the frames they speak of; JSON values.

        Args:
            reason: reason code; empty for all.
            text: part of the unit's id or of the message, in capitals or not; empty for all.
            offset: how many are left out before the first.
            limit: how many are listed.

        Raises:
            ConfigError: no refusal has such a reason.
        """
        known = [name for name, _ in self.reasons()]
        if reason and reason not in known:
            raise ConfigError(f"nothing was refused for {reason!r}; {did_you_mean(reason, known)}")
        wanted = text.casefold()
        found = [
            (number, line)
            for number, line in enumerate(self._lines)
            if (not reason or line["reason"] == reason)
            and (wanted in str(line["unit"]).casefold() or wanted in str(line.get("message", "")).casefold())
        ]
        shown = [
            {
                **to_json(dict(line)),
                "number": number,
                "frame": named_frame(line),
                "names_image": named_image(str(line.get("message", ""))) is not None,
            }
            for number, line in found[offset : offset + limit]
        ]
        return {"total": len(found), "refusals": shown}


def named_frame(refusal: Mapping[str, object]) -> int | None:
    """The frame that a refusal speaks of, from its measured numbers or else from its message; None: it names none."""
    details = refusal.get("details")
    if isinstance(details, Mapping):
        measured = details.get("measured")
        known = {**details, **(measured if isinstance(measured, Mapping) else {})}
        for name in _FRAME_NAMES:
            value = known.get(name)
            first = value[0] if isinstance(value, list) and value else value  # the first of a pair of frames
            if isinstance(first, int) and first >= 0:
                return first
    said = _FRAME_IN_TEXT.search(str(refusal.get("message", "")))
    return int(said[1]) if said else None
