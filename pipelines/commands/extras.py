"""Packages that only some installations have."""

import importlib.util

from wsm_data.errors import ConfigError


def require_extra(extra: str, packages: tuple[str, ...]) -> None:
    """Say which extra brings what a command needs, in place of a traceback of its imports.

    Raises:
        ConfigError: one of the packages is missing.
    """
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise ConfigError(
            f"this command needs {', '.join(missing)}: install the extra in a clone with: pip install -e '.[{extra}]'"
        )
