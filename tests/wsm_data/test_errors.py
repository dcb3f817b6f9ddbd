"""The error family: exit codes, and a refusal that survives a process boundary."""

import pickle
import re

import pytest

from wsm_data.errors import (
    BudgetExceeded,
    ConfigError,
    DataError,
    IntegrityError,
    Reason,
    RemotePlannerError,
    StoreError,
    WsmError,
)


@pytest.mark.parametrize(
    ("kind", "code"),
    [(ConfigError, 2), (BudgetExceeded, 3), (IntegrityError, 4), (StoreError, 5), (RemotePlannerError, 7)],
)
def test_each_foreseen_failure_has_its_exit_code(kind, code):
    assert issubclass(kind, WsmError)
    assert kind("message").exit_code == code


def test_a_refusal_crosses_a_process_boundary_whole():
    error = DataError(Reason.POSE_JUMP, "the camera jumps by 3.2 m at frame 17", {"jump_m": 3.2, "frame": 17})
    copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - what a process pool does with it
    assert copy.reason is Reason.POSE_JUMP
    assert copy.message == str(copy) == error.message
    assert copy.details == {"jump_m": 3.2, "frame": 17}


def test_details_are_a_copy_that_the_caller_cannot_change_afterwards():
    details = {"frame": 17}
    error = DataError(Reason.FRAME_EMPTY, "frame 17 is empty", details)
    details["frame"] = 18
    assert error.details == {"frame": 17}


def test_a_refusal_without_details_has_an_empty_mapping():
    assert DataError(Reason.FRAME_EMPTY, "frame 17 is empty").details == {}


def test_reason_codes_are_distinct_dotted_words_that_match_their_names():
    codes = [reason.value for reason in Reason]
    assert len(set(codes)) == len(Reason.__members__)  # a repeated value would be an alias, not a member
    for name, reason in Reason.__members__.items():
        assert re.fullmatch(r"[a-z]+\.[a-z0-9_]+", reason), reason
        assert name == reason.replace(".", "_").upper()


def test_a_reason_is_written_as_its_code():
    assert str(Reason.ARCHIVE_POINTER_FILE) == "archive.pointer_file"


def test_a_message_shows_names_that_a_terminal_must_not_see_as_escapes():
    assert str(ConfigError("a\x1b[31m\udcff\u202eb\nc")) == "a\\x1b[31m\\udcff\\u202eb\nc"
    assert DataError(Reason.FRAME_EMPTY, "\x07").message == "\\x07"


def test_a_message_leaves_out_what_may_be_a_credential_in_a_url():
    message = "no answer of https://me:planted@host/a?X-Amz-Signature=planted&part=1; ask s3://bucket/key@2"
    assert str(StoreError(message)) == "no answer of https://***@host/a?***&part=1; ask s3://bucket/key@2"
