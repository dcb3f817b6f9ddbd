"""What may pass is asked again with growing pauses; what lasts is not; every error names object, attempts and cause."""

import errno
from types import SimpleNamespace

import aiohttp
import botocore.exceptions
import botocore.parsers
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import StoreError
from wsm_data.files.retries import RequestConfig, ask, backoff_s, may_pass

NAME = "s3://bucket/release/train-000000.tar"
CONFIG = RequestConfig(attempts=4, first_backoff_s=1.0)


def http_status(status):
    return aiohttp.ClientResponseError(SimpleNamespace(real_url=NAME), (), status=status, message="spoilt")


PASSING = [
    ConnectionResetError("reset"),
    ConnectionRefusedError("refused"),
    BrokenPipeError("broken"),
    TimeoutError(),
    OSError(errno.EIO, "a body cut short"),
    OSError(errno.EBUSY, "SlowDown"),
    OSError(errno.EREMOTEIO, "InternalError"),
    aiohttp.ClientPayloadError("not all of the body"),
    aiohttp.ServerDisconnectedError(),
    http_status(500),
    http_status(503),
    http_status(429),
    botocore.exceptions.EndpointConnectionError(endpoint_url=NAME, error="refused"),
    botocore.exceptions.ConnectionClosedError(endpoint_url=NAME),
    botocore.exceptions.ReadTimeoutError(endpoint_url=NAME),
    botocore.exceptions.FlexibleChecksumError(error_msg="another crc32"),
    botocore.parsers.ResponseParserError("no XML"),
]
LASTING = [
    PermissionError(errno.EACCES, "Access Denied"),
    IsADirectoryError("a folder"),
    OSError(errno.EINVAL, "malformed"),
    OSError(errno.ENOSYS, "NotImplemented"),
    http_status(400),
    http_status(403),
    http_status(416),
    botocore.exceptions.NoCredentialsError(),
    botocore.exceptions.ParamValidationError(report="a bucket's name"),
]


def name_of(error):
    return f"{type(error).__name__} {error}"[:40]


class Flaky:
    """Raises the errors one after the other, then answers."""

    def __init__(self, *errors):
        self.errors, self.calls = list(errors), 0

    def __call__(self):
        self.calls += 1
        if self.errors:
            raise self.errors.pop(0)
        return b"answer"


@pytest.mark.parametrize("error", PASSING, ids=name_of)
def test_what_may_pass_is_asked_again(error):
    request, pauses = Flaky(error, error, error), []
    assert ask(request, NAME, CONFIG, pauses.append) == b"answer"
    assert request.calls == 4
    assert len(pauses) == 3


@pytest.mark.parametrize("error", PASSING, ids=name_of)
def test_what_does_not_pass_in_time_names_object_attempts_and_cause(error):
    request = Flaky(*[error] * 9)
    with pytest.raises(
        StoreError, match=f"^{NAME}: no answer in 4 attempts, at last because of {type(error).__name__}"
    ):
        ask(request, NAME, CONFIG, lambda _: None)
    assert request.calls == 4


@pytest.mark.parametrize("error", LASTING, ids=name_of)
def test_what_lasts_is_asked_once(error):
    request = Flaky(error)
    with pytest.raises(StoreError, match=f"^{NAME}: the store refuses .*{type(error).__name__}") as raised:
        ask(request, NAME, CONFIG, pytest.fail)
    assert request.calls == 1
    assert raised.value.__cause__ is error


@pytest.mark.parametrize("error", [FileNotFoundError("none"), NotADirectoryError("none")], ids=name_of)
def test_that_nothing_is_there_is_said_as_it_is(error):
    with pytest.raises(type(error)):
        ask(Flaky(error), NAME, CONFIG, pytest.fail)
    assert not may_pass(error)


@pytest.mark.parametrize("bug", [ValueError("bug"), KeyError("bug"), ZeroDivisionError()], ids=name_of)
def test_a_bug_is_not_taken_for_a_failure_of_the_store(bug):
    with pytest.raises(type(bug)):
        ask(Flaky(bug), NAME, CONFIG, pytest.fail)


def test_the_first_refusal_ends_the_attempts():
    request = Flaky(ConnectionResetError(), PermissionError())
    with pytest.raises(StoreError, match="refuses"):
        ask(request, NAME, CONFIG, lambda _: None)
    assert request.calls == 2


@given(attempt=st.integers(1, 2000), first=st.floats(1e-3, 1e6))
def test_pauses_double_up_to_half_a_minute_and_are_shortened_by_at_most_one_half(attempt, first):
    longest = min(30.0, first * 2.0 ** min(attempt - 1, 32))
    pause = backoff_s(attempt, RequestConfig(first_backoff_s=first))
    assert longest / 2 <= pause <= longest


@pytest.mark.parametrize(
    "change", [{"attempts": 0}, {"connections": 0}, {"first_backoff_s": -1.0}, {"timeout_s": 0.0}], ids=str
)
def test_settings_that_make_no_sense_are_refused(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        RequestConfig(**change)
