"""What a reader of shards was told to expect: stretches that were announced and not read yet, by shard."""

from collections.abc import Sequence
from itertools import takewhile
from typing import Generic, TypeVar

from wsm_data.access.shard_reader import Span

Value = TypeVar("Value")

_OUTDATED = 4096


class Announcements(Generic[Value]):
    """Announced stretches, with a value each. Not safe by itself: its owner holds a lock.

    A stretch may be read in pieces, in ascending order: it counts as read when a piece reaches its end. One that was
    announced 4096 stretches before another that has been read counts as given up: who announced it went another way.
    """

    def __init__(self) -> None:
        self._shards: dict[str, dict[Span, Value]] = {}
        self._numbers: dict[Span, int] = {}
        self._count = 0

    def shards(self) -> list[str]:
        """Shards with announced stretches; the one that is needed first stands in front."""
        return list(self._shards)

    def unknown(self, spans: Sequence[Span]) -> list[Span]:
        """Those of the stretches that are not announced, each once."""
        return [span for span in dict.fromkeys(spans) if span not in self._numbers]

    def add(self, span: Span, value: Value) -> None:
        """Announce a stretch that is not announced yet."""
        self._shards.setdefault(span.shard, {})[span] = value
        self._numbers[span] = self._count
        self._count += 1

    def find(self, piece: Span) -> tuple[Span, Value] | None:
        """The announced stretch that a piece belongs to, with its value."""
        for span, value in self._shards.get(piece.shard, {}).items():
            if span.offset <= piece.offset and piece.end <= span.end:
                return span, value
        return None

    def remove(self, span: Span) -> None:
        """Strike a stretch, because it was read; nothing where it is not announced, or was given up."""
        number = self._numbers.get(span)
        if number is None:
            return
        outdated = takewhile(lambda other: self._numbers[other] < number - _OUTDATED, self._numbers)
        for old in [span, *outdated]:
            self._drop(old)

    def _drop(self, span: Span) -> None:
        del self._numbers[span]
        del self._shards[span.shard][span]
        if not self._shards[span.shard]:
            del self._shards[span.shard]
