"""In what two JSON objects differ, such as the settings of two runs."""

import json
from collections.abc import Mapping
from typing import Any

_ABSENT: Any = object()


def differences(old: Any, new: Any, where: str = "") -> list[str]:
    """Lines `name: old -> new`, values as JSON, for everything that differs, in the order of the names.

    Objects are compared member by member (`section.name`), lists of objects item by item (`name[0]`). What one side
    does not have is `absent` there.
    """
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        return [
            line
            for key in sorted({*old, *new})
            for line in differences(old.get(key, _ABSENT), new.get(key, _ABSENT), f"{where}.{key}" if where else key)
        ]
    if isinstance(old, list) and isinstance(new, list) and any(isinstance(item, Mapping) for item in old + new):
        return [
            line
            for number in range(max(len(old), len(new)))
            for line in differences(_item(old, number), _item(new, number), f"{where}[{number}]")
        ]
    same = old == new and isinstance(old, bool) == isinstance(new, bool)
    return [] if same else [f"{where}: {_word(old)} -> {_word(new)}"]


def _item(values: list[Any], number: int) -> Any:
    return values[number] if number < len(values) else _ABSENT


def _word(value: Any) -> str:
    return "absent" if value is _ABSENT else json.dumps(value, sort_keys=True)
