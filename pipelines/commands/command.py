"""What a command is: a name, a line of help, and a function whose parameters are its options."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Command:
    """One command.

    Attributes:
        name: the word that is typed.
        summary: its help.
        call: what it does; typer reads its options from the annotations.
        epilog: text below the options.
    """

    name: str
    summary: str
    call: Callable[..., None]
    epilog: str = ""


@dataclass(frozen=True, kw_only=True)
class CommandGroup:
    """Commands below one word, as `wsm bench loader`.

    Attributes:
        name: the word.
        summary: its help.
        commands: the commands.
    """

    name: str
    summary: str
    commands: tuple[Command, ...]
