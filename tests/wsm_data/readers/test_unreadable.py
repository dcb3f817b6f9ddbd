import errno
import os

import pytest

from wsm_data.errors import DataError, Reason
from wsm_data.readers.unreadable import read_file, refusing_unreadable


@pytest.mark.parametrize("number", [errno.ENOENT, errno.EACCES, errno.EIO, errno.ESTALE, errno.ELOOP])
def test_a_file_that_cannot_be_read_is_refused_by_name(number):
    words = "the words of the system"
    with pytest.raises(DataError, match=rf"scene:a\.jpg .*{words}") as caught, refusing_unreadable("scene:a.jpg"):
        raise OSError(number, words)
    assert caught.value.reason is Reason.FILE_UNREADABLE
    assert caught.value.details == {"errno": number, "error": errno.errorcode[number]}


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EMFILE, errno.ENFILE, errno.ENOMEM])
def test_what_the_machine_lacks_is_not_the_files_fault(number):
    with pytest.raises(OSError, match="no more") as caught, refusing_unreadable("a"):
        raise OSError(number, "no more")
    assert caught.value.errno == number


def test_a_file_is_read_whole_or_refused_by_name(tmp_path):
    content = bytes(range(256)) * 5000
    (tmp_path / "a.jpg").write_bytes(content)
    assert read_file(f"{tmp_path}/a.jpg", "scene:a.jpg", 10**7) == content
    for name in ("b.jpg", "."):  # absent, and a folder
        with pytest.raises(DataError, match="scene:b") as caught:
            read_file(f"{tmp_path}/{name}", "scene:b", 10**7)
        assert caught.value.reason is Reason.FILE_UNREADABLE


def test_a_file_above_the_limit_is_refused_unread(tmp_path):
    with (tmp_path / "a").open("wb") as file:
        file.truncate(1 << 40)  # of holes: reading it would take all memory
    with pytest.raises(DataError) as caught:
        read_file(str(tmp_path / "a"), "a", 1 << 30)
    assert (caught.value.reason, caught.value.details["bytes"]) == (Reason.FILE_TOO_LARGE, 1 << 40)


@pytest.mark.timeout(10)
def test_a_pipe_and_a_device_are_refused_without_being_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")  # nobody writes: opening it would wait for ever
    (tmp_path / "device").symlink_to("/dev/zero")
    for name in ("pipe", "device"):
        with pytest.raises(DataError) as caught:
            read_file(str(tmp_path / name), name, 100)
        assert caught.value.reason is Reason.FILE_NOT_REGULAR
