import io
import subprocess
import tarfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.shards.tar_format import (
    END_OF_ARCHIVE,
    MAX_KEY_BYTES,
    NPY_HEADER_BYTES,
    member_header,
    npy_header,
    padded,
    require_key,
)

# plain, split at a slash into prefix and name, and too long for either: a pax record
NAMES = {
    "plain": "synth_d435i/home_0001/000003.rgb_latent.npy",
    "prefix": "g" * 90 + "/" + "s" * 60 + "/" + "e" * 80 + ".rgb_latent.npy",
    "pax": "g" * 20 + "/" + "s" * 30 + "/" + "e" * 120 + ".rgb_latent.npy",
}


def _archive(name: str, data: bytes) -> bytes:
    return member_header(name, len(data)) + data.ljust(padded(len(data)), b"\0") + END_OF_ARCHIVE


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_the_standard_library_reads_the_member_with_fixed_owner_mode_and_time(name: str) -> None:
    with tarfile.open(fileobj=io.BytesIO(_archive(name, b"hello"))) as archive:
        [member] = archive.getmembers()
        file = archive.extractfile(member)
        assert file is not None
        assert file.read() == b"hello"
    assert (member.name, member.size, member.mode, member.uid, member.gid, member.mtime) == (name, 5, 0o644, 0, 0, 0)
    assert (member.uname, member.gname, member.isreg()) == ("", "", True)


@pytest.mark.parametrize(("name", "blocks"), list(zip(NAMES.values(), (1, 1, 3), strict=True)), ids=NAMES)
def test_only_a_name_that_fits_no_field_costs_further_blocks(name: str, blocks: int) -> None:
    assert len(member_header(name, 1)) == 512 * blocks


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_gnu_tar_lists_the_member_without_a_word(name: str, tmp_path: Path) -> None:
    path = tmp_path / "one.tar"
    path.write_bytes(_archive(name, b"hello"))
    done = subprocess.run(["tar", "-tf", path], capture_output=True, check=True, text=True)
    assert (done.stdout, done.stderr) == (f"{name}\n", "")


@given(st.integers(1, 99), st.integers(1, 199), st.integers(1, 199), st.integers(0, 8**11 - 1))
def test_any_name_and_size_survive(group: int, scene: int, episode: int, size: int) -> None:
    name = f"{'g' * group}/{'s' * scene}/{'e' * episode}.geodesic_mm.npy"
    header = member_header(name, size)
    with tarfile.open(fileobj=io.BytesIO(header), mode="r|") as archive:
        member = archive.next()
    assert member is not None
    assert (member.name, member.size, len(header) % 512) == (name, size, 0)


def test_a_pax_length_that_gains_a_digit_by_its_own_digits_is_counted_right() -> None:
    for length in range(85, 105):  # "NN path=<name>\n" passes from two to three digits in here
        name = "e" * (length + 16)
        with tarfile.open(fileobj=io.BytesIO(member_header(name, 0)), mode="r|") as archive:
            member = archive.next()
        assert member is not None
        assert member.name == name


def test_a_size_that_eleven_octal_digits_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="8589934591"):
        member_header("a.npy", 8**11)


@pytest.mark.parametrize("shape", [(3, 48, 12, 20), (1,), (13, 7), (100_000, 48, 1080, 1920), ()])
def test_numpy_reads_the_array_header_as_its_own(shape: tuple[int, ...]) -> None:
    header = npy_header(np.dtype("<f2"), shape)
    file = io.BytesIO(header)
    assert np.lib.format.read_magic(file) == (1, 0)
    assert np.lib.format.read_array_header_1_0(file) == (shape, False, np.dtype("<f2"))
    assert file.tell() == len(header) == NPY_HEADER_BYTES


def test_the_array_header_says_what_numpy_would_write() -> None:
    file = io.BytesIO()
    np.save(file, np.zeros((3, 7), np.float32), allow_pickle=False)
    ours, theirs = npy_header(np.dtype("<f4"), (3, 7)), file.getvalue()[:128]
    assert ours.split() == theirs.split()  # numpy pads the text too, by an amount that changed between versions


def test_a_shape_of_too_many_digits_is_refused() -> None:
    with pytest.raises(ValueError, match="must fit 128 bytes"):
        npy_header(np.dtype("<f2"), (10**9,) * 12)


@pytest.mark.parametrize("key", ["synth_d435i/home_0001/000003", "a/b%2Ec/d-e", "e" * 50, "/".join("abcd")])
def test_a_key_that_webdataset_reads_is_accepted(key: str) -> None:
    require_key(key, "a/b/c")


@pytest.mark.parametrize(
    "key",
    [
        *("a/b.c/d", "a//d", "/a/b", "a/..", "", "a/b c", "a/ü", "a/b\n", "__a__/b/c", "__a__", "a/" + "b" * 201),
        "/".join(["a" * 100, "b" * 100, "c" * 54]),
    ],
)
def test_a_key_that_webdataset_would_cut_skip_or_not_name_is_refused(key: str) -> None:
    with pytest.raises(DataError) as caught:
        require_key(key, "a/b/c")
    assert caught.value.reason == Reason.EPISODE_UNSTORABLE_NAME
    assert caught.value.details == {"key": key}


def test_a_name_that_is_not_utf_8_is_refused_though_it_has_a_key() -> None:
    with pytest.raises(DataError, match="not valid UTF-8") as caught:
        require_key("a/%ED%B2%80/c", "a/\udc80/c")
    assert caught.value.reason == Reason.EPISODE_UNSTORABLE_NAME


def test_the_longest_key_is_accepted() -> None:
    key = "/".join(["a" * 100, "b" * 100, "c" * 53])
    assert len(key) == MAX_KEY_BYTES
    require_key(key, "a/b/c")
