"""The two line files of a scene's meta folder, read forgivingly: they are often absent, half written or wrong.

What they say is only used where nothing better is known, so a line that cannot be read is passed over here; where its
content turns out to be needed, the episode is refused for the lack of it.
"""

import json
from collections.abc import Iterator

from wsm_data.readers.interndata.naming import ImageSpan

_MAX_NUMBER = 10**18
"""An episode or image number is below it; json reads integers of thousands of digits."""


def read_lengths(data: memoryview) -> dict[int, int]:
    """`length` by episode number of meta/episodes.jsonl, where a line states both."""
    lengths = {}
    for number, line in _episodes(data):
        length = line.get("length")
        if type(length) is int:
            lengths[number] = length
    return lengths


def read_image_spans(data: memoryview) -> dict[int, ImageSpan]:
    """`image_index` by episode number of meta/episodes_stats.jsonl: {min, max}, both inclusive.

    It stands at the top of a line or under `stats`, its values as numbers or as lists of one.
    """
    spans = {}
    for number, line in _episodes(data):
        stats = line.get("stats")
        index = line.get("image_index", stats.get("image_index") if isinstance(stats, dict) else None)
        if isinstance(index, dict):
            first, last = _whole(index.get("min")), _whole(index.get("max"))
            if first is not None and last is not None and 0 <= first <= last:
                spans[number] = ImageSpan(first, last)
    return spans


def _episodes(data: memoryview) -> Iterator[tuple[int, dict[str, object]]]:
    """Lines with their episode number: `episode_index`, or their position where a line does not say."""
    for position, text in enumerate(line for line in bytes(data).splitlines() if line.strip()):
        try:
            line = json.loads(text)
        except (ValueError, RecursionError):  # RecursionError: brackets in brackets, a hundred thousand deep
            continue
        if isinstance(line, dict):
            number = _whole(line.get("episode_index", position))
            if number is not None:
                yield number, line


def _whole(value: object) -> int | None:
    if isinstance(value, list) and len(value) == 1:
        return _whole(value[0])
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value if type(value) is int and abs(value) < _MAX_NUMBER else None
