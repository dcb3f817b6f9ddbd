"""The digests of a file are those that stores and git give it; each is compared with a direct computation."""

import base64
import hashlib
import subprocess
from functools import partial

import pytest

from wsm_data.files.uploads.local_file import look_at

DATA = bytes(range(256)) * 40  # 10,240 bytes
md5 = partial(hashlib.md5, usedforsecurity=False)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(DATA)
    return path


def test_a_file_is_named_as_sha256_and_git_name_it(path):
    file = look_at(path, 4096)
    git = subprocess.run(["git", "hash-object", str(path)], capture_output=True, text=True, check=True)
    assert (file.size_bytes, file.sha256) == (10240, hashlib.sha256(DATA).hexdigest())
    assert file.git_sha1 == git.stdout.strip()


def test_a_file_of_one_part_has_its_md5_as_etag(path):
    assert look_at(path, 10240).etag == md5(DATA).hexdigest()


def test_a_file_of_several_parts_has_the_md5_of_their_md5s_and_their_number_as_etag(path):
    parts = [DATA[:4096], DATA[4096:8192], DATA[8192:]]
    joined = b"".join(md5(part).digest() for part in parts)
    file = look_at(path, 4096)
    assert file.etag == f"{md5(joined).hexdigest()}-3"
    assert [file.part(number) for number in range(3)] == parts
    assert file.content_md5(2) == base64.b64encode(md5(parts[2]).digest()).decode()


def test_a_file_of_no_bytes_is_one_part(tmp_path):
    (tmp_path / "empty").touch()
    file = look_at(tmp_path / "empty", 4096)
    assert (file.etag, file.part(0)) == (md5(b"").hexdigest(), b"")
