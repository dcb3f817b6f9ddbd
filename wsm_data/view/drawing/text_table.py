"""Aligned text for terminals, and numbers as people read them."""

from collections.abc import Sequence

_BYTE_UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB")


def printable(text: str) -> str:
    """Text that any terminal and page can show: what is no valid character in a file's name is spelled out."""
    return text.encode("utf-8", "backslashreplace").decode()


def bytes_text(count: int) -> str:
    """A number of bytes with three digits: 512 bytes, 3.42 MB, 1.05 TB; a kB is 1000 bytes."""
    size, unit = float(count), 0
    while size >= 999.5 and unit < len(_BYTE_UNITS) - 1:
        size, unit = size / 1000, unit + 1
    if not unit:
        return f"{count} bytes"
    return f"{size:.{max(0, 2 - len(str(int(size))) + 1)}f} {_BYTE_UNITS[unit]}"


def aligned(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Rows of cells as lines of columns two blanks apart, the first row a header.

    Args:
        rows: cells; every row has as many as the first.
        right: numbers of the columns that are set flush right.
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
