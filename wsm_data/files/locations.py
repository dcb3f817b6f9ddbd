"""Where something lies: a path on this machine, or a URL. Light: the command line asks, too."""

import re
from pathlib import Path

from wsm_data.errors import ConfigError, without_secrets

_CUT_URL = re.compile(r"^([A-Za-z][A-Za-z0-9+.-]+):/(?!/)")
"""What `Path` makes of a URL. No folder of a person begins so."""


def require_no_secret(location: str) -> None:
    """Check that a URL holds no credential: it is written into records, reports and messages.

    Raises:
        ConfigError: it does; the message leaves them out.
    """
    if (shown := without_secrets(location)) != location:
        raise ConfigError(
            f"a URL must hold no credentials, for it is written down in records and reports; found {shown}. Give them "
            "by the environment, or by the files of the store's client"
        )


def is_url(location: str | Path) -> bool:
    """Whether a location is an fsspec URL (anything with `://`), and no local path."""
    return "://" in str(location)


def require_local(name: str, location: str | Path) -> None:
    """Check that something that is read or written in place lies on this machine.

    Args:
        name: setting or option, for the message.
        location: what it was given.

    Raises:
        ConfigError: it is a URL.
    """
    text = _CUT_URL.sub(r"\1://", str(location), count=1) if isinstance(location, Path) else location
    if is_url(text):
        raise ConfigError(
            f"{name} must be a path on this machine, found the URL {text}; copy or mount what it names and give the "
            "path of that. Only releases, and scores and selections of them, may be URLs"
        )
