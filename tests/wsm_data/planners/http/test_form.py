"""Forms, against Python's own reader of mail and a form written by hand."""

import email.parser

import pytest

from wsm_data.planners.http.fault import Fault, WireError
from wsm_data.planners.http.form import FormFile, read_form, write_form

PICTURE = FormFile(name="image.jpg", media_type="image/jpeg", data=bytes(range(256)) + b"\r\n--x\r\n")
BY_HAND = b'--b\r\nContent-Disposition: form-data; name="a"\r\n\r\n1\r\n--b--\r\n'


def test_another_reader_finds_the_same_parts():
    kind, body = write_form({"goal_data": "{}"}, {"image": PICTURE})
    message = email.parser.BytesParser().parsebytes(f"Content-Type: {kind}\r\n\r\n".encode() + body)
    text, file = message.get_payload()
    assert text.get_param("name", header="content-disposition") == "goal_data"
    assert text.get_payload(decode=True) == b"{}"
    assert file.get_filename() == "image.jpg"
    assert file.get_content_type() == "image/jpeg"


def test_bytes_of_a_file_come_back_whatever_they_are():
    parts = read_form(*write_form({"goal_data": "{}"}, {"image": PICTURE}))
    assert parts == {"goal_data": b"{}", "image": PICTURE.data}


def test_a_form_by_hand_is_read():
    assert read_form('multipart/form-data; boundary="b"', BY_HAND) == {"a": b"1"}


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("application/json", b"{}"),
        ("multipart/form-data", BY_HAND),
        ("multipart/form-data; boundary=c", BY_HAND),
        ("multipart/form-data; boundary=b", BY_HAND[:-12]),
        ("multipart/form-data; boundary=b", b""),
        ("multipart/form-data; boundary=b", BY_HAND[:-5] + b"\r\n" + BY_HAND),
        ("multipart/form-data; boundary=b", (BY_HAND[:-5] + b"\r\n") * 40 + BY_HAND),
    ],
    ids=["json", "no boundary", "other boundary", "cut", "empty", "a name twice", "many parts"],
)
def test_what_is_no_proper_form_is_malformed(kind, body):
    with pytest.raises(WireError) as refused:
        read_form(kind, body)
    assert refused.value.fault is Fault.MALFORMED
