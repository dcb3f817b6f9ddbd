import struct
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pytest

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.readers.guard import guarded, refusing_unparsable
from wsm_data.readers.interndata.reader import INTERNDATA
from wsm_data.readers.source import Container


def failing(error):
    def fail(*_):
        raise error

    return guarded(replace(INTERNDATA, scan=fail, iter_frames=fail))


def container(name):
    return Container(id=name, layout="scene_folder", signature="")


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        RecursionError("too deep"),
        ValueError("Exceeds the limit (4300 digits)"),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "no"),
        OverflowError("too large"),
        struct.error("short"),
        pa.ArrowInvalid("no table"),
        pa.ArrowMemoryError("malloc"),
    ],
)
def test_what_bytes_do_to_a_parser_is_a_refusal_of_the_container(error, dataset):
    for call in (
        lambda reader: reader.scan(Path(), container("g/s"), dataset, 1),
        lambda reader: list(reader.iter_frames(Path(), container("g/s"), dataset, [])),
    ):
        with pytest.raises(DataError, match=f"g/s must .*{type(error).__name__}") as caught:
            call(failing(error))
        assert caught.value.reason is Reason.CONTAINER_UNPARSABLE
        assert caught.value.details["at"].startswith("test_guard.py:")


@pytest.mark.parametrize("error", [KeyError("a"), TypeError("b"), IntegrityError("c")])
def test_a_fault_of_the_reader_and_a_foreseen_error_pass(error):
    with pytest.raises(type(error)), refusing_unparsable("g/s"):
        raise error


@pytest.mark.parametrize(
    ("name", "shown"), [("g/a\x1b[31m", r"a\\x1b\[31m"), ("g/\udcff", r"\\udcff"), ("g/a\nb", r"a\\nb")]
)
def test_a_name_that_cannot_be_stored_or_shown_is_refused_escaped(dataset, name, shown):
    with pytest.raises(DataError, match=shown) as caught:
        guarded(INTERNDATA).scan(Path(), container(name), dataset, 1)
    assert caught.value.reason is Reason.CONTAINER_UNSTORABLE_NAME
