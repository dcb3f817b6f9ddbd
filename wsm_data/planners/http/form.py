"""Forms of a request: a few named parts, of which some are files."""

import io
import secrets
from collections.abc import Mapping
from dataclasses import dataclass

from multipart import MultipartError, MultipartParser, parse_options_header

from wsm_data.planners.http.fault import Fault, WireError

_MOST_PARTS = 16


@dataclass(frozen=True, kw_only=True)
class FormFile:
    """A file in a form.

    Attributes:
        name: file name.
        media_type: as `image/png`.
        data: its bytes.
    """

    name: str
    media_type: str
    data: bytes


def write_form(fields: Mapping[str, str], files: Mapping[str, FormFile]) -> tuple[str, bytes]:
    """The content type and the body of a form."""
    boundary = secrets.token_hex(16)
    parts = [
        _part(boundary, f'name="{name}"', "text/plain; charset=utf-8", text.encode()) for name, text in fields.items()
    ]
    for name, file in files.items():
        parts.append(_part(boundary, f'name="{name}"; filename="{file.name}"', file.media_type, file.data))
    return f"multipart/form-data; boundary={boundary}", b"".join([*parts, f"--{boundary}--\r\n".encode()])


def _part(boundary: str, names: str, media_type: str, data: bytes) -> bytes:
    head = f"--{boundary}\r\nContent-Disposition: form-data; {names}\r\nContent-Type: {media_type}\r\n\r\n"
    return head.encode() + data + b"\r\n"


def read_form(content_type: str, body: bytes) -> Mapping[str, bytes]:
    """The parts of a form by name.

    Raises:
        WireError: `malformed`: another content type, no proper form, too many parts, or two of one name.
    """
    kind, options = parse_options_header(content_type)
    if kind != "multipart/form-data" or not options.get("boundary"):
        raise WireError(
            Fault.MALFORMED, f"the content type must be multipart/form-data with a boundary, found {content_type!r}"
        )
    room = len(body) + 1  # the body is in memory already; nothing goes to a disk
    parser = MultipartParser(
        io.BytesIO(body),
        options["boundary"],
        content_length=len(body),
        strict=True,
        part_limit=_MOST_PARTS,
        partsize_limit=room,
        spool_limit=room,
        memory_limit=room,
    )
    found: dict[str, bytes] = {}
    try:
        for part in parser:
            if part.name in found:
                raise WireError(Fault.MALFORMED, f"the form names {part.name!r} twice")
            found[part.name] = part.raw
    except MultipartError as error:
        raise WireError(Fault.MALFORMED, f"the body must be a whole form, but {error}") from error
    return found
