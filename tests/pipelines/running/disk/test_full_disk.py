"""A full disk is a sentence, and nothing else is taken for one."""

import errno
import os

import pytest

from pipelines.running.disk.full_disk import full_disk_named
from wsm_data.errors import WsmError


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_no_room_names_the_folder_and_what_to_do(tmp_path, number):
    said = rf"^the disk of {tmp_path} is full \(.*\); free space and run the same command"
    with pytest.raises(WsmError, match=said), full_disk_named(tmp_path):
        raise OSError(number, os.strerror(number))


def test_another_refusal_of_the_system_stays_what_it_is(tmp_path):
    with pytest.raises(PermissionError), full_disk_named(tmp_path):
        raise PermissionError(errno.EACCES, "Permission denied")
