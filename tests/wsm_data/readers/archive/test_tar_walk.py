import gzip
import io
import tarfile

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.errors import DataError, Reason
from wsm_data.readers.archive.tar_walk import walk_tar

FORMATS = {"ustar": tarfile.USTAR_FORMAT, "gnu": tarfile.GNU_FORMAT, "pax": tarfile.PAX_FORMAT}
FILES = {f"scene/file_{n:02d}": bytes([n]) * (700 * n) for n in range(8)}


def tar_of(files, kind="pax", **header):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=FORMATS[kind]) as tar:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            for key, value in header.items():
                setattr(info, key, value)
            tar.addfile(info, io.BytesIO(data))
    return buffer.getvalue()


def walk(path, data, wanted=lambda name: True):
    path.write_bytes(data)
    return {member.name: bytes(member.data) for member in walk_tar(path, "group/scene.tar.gz", wanted, 10**9)}


def reason_of(path, data):
    with pytest.raises(DataError, match="group/scene") as caught:
        walk(path, data)
    return caught.value.reason


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("name", ["a/b", "a/" + "n" * 99, "d" * 90 + "/" + "n" * 60, "a/" + "ü" * 80])
def test_files_come_as_tarfile_reads_them(tmp_path, kind, name):
    if kind == "ustar" and "ü" in name:
        pytest.skip("ustar has no room for it")
    files = {name: b"first" * 200, "a/zero": b"", **FILES}
    assert walk(tmp_path / "a", gzip.compress(tar_of(files, kind))) == files


def test_gnu_names_longer_than_a_block_are_read(tmp_path):
    files = {"a/" + "/".join(["long"] * 300): b"content", "a/next": b"x"}
    for kind in ("gnu", "pax"):
        assert walk(tmp_path / "a", gzip.compress(tar_of(files, kind))) == files


def test_what_is_not_wanted_is_passed_over_but_still_checked(tmp_path):
    data = gzip.compress(tar_of(FILES))
    assert list(walk(tmp_path / "a", data, lambda name: name.endswith("03"))) == ["scene/file_03"]
    assert walk(tmp_path / "a", data, lambda name: False) == {}


def test_a_member_larger_than_the_buffer_comes_whole(tmp_path):
    files = {
        "a/small": b"s" * 1000,
        "a/large": bytes(range(256)) * 20_000,
        "a/last": b"e",
    }  # 5.1 MB, the buffer has 0.5
    assert walk(tmp_path / "a", gzip.compress(tar_of(files), 1)) == files


def test_several_gzip_members_in_a_row_are_one_stream(tmp_path):
    tar = tar_of(FILES)
    assert walk(tmp_path / "a", gzip.compress(tar[:3000]) + gzip.compress(tar[3000:])) == FILES


def test_folders_and_old_style_folders_hold_no_file(tmp_path):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as tar:
        folder = tarfile.TarInfo("scene")
        folder.type = tarfile.DIRTYPE
        tar.addfile(folder)
        old = tarfile.TarInfo("scene/old/")
        old.type = tarfile.AREGTYPE
        tar.addfile(old)
    assert walk(tmp_path / "a", gzip.compress(buffer.getvalue())) == {}


def test_sizes_in_binary_and_in_pax_records_are_read(tmp_path):
    data = bytearray(tar_of({"a/b": b"12345"}, "gnu"))
    data[124:136] = (1 << 95 | 5).to_bytes(12, "big")
    data[148:156] = b"%06o\0 " % (sum(data[:148]) + 256 + sum(data[156:512]))
    assert walk(tmp_path / "a", gzip.compress(bytes(data))) == {"a/b": b"12345"}
    sized = tar_of({"a/b": b"12345"}, pax_headers={"size": "5"})
    assert walk(tmp_path / "a", gzip.compress(sized)) == {"a/b": b"12345"}


def test_a_pointer_file_is_refused_by_name(tmp_path):
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 249000000\n"
    assert reason_of(tmp_path / "a", pointer) is Reason.ARCHIVE_POINTER_FILE


def test_what_is_named_gzip_and_is_not_is_refused(tmp_path):
    assert reason_of(tmp_path / "a", b"<html>") is Reason.ARCHIVE_NOT_GZIP
    assert reason_of(tmp_path / "a", b"PK\x03\x04 zip") is Reason.ARCHIVE_NOT_GZIP


def test_a_member_above_the_limit_is_refused_and_passed_over_and_the_others_are_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(gzip.compress(tar_of({"a/large": bytes(3000), "a/small": b"content"})))
    large, small = ((one.refusal, bytes(one.data)) for one in walk_tar(path, "scene", lambda name: True, 2999))
    assert (large[0].reason, large[0].details) == (Reason.FILE_TOO_LARGE, {"bytes": 3000, "limit": 2999})
    assert small == (None, b"content")


def test_a_volume_label_is_passed_over_and_a_hard_link_says_how_to_pack_anew(tmp_path):
    def packed(kind):
        buffer = io.BytesIO()
        with tarfile.open(fileobj=buffer, mode="w") as tar:
            other = tarfile.TarInfo("a/other")
            other.type, other.linkname = kind, "a/b"
            tar.addfile(other)
            tar.addfile(tarfile.TarInfo("a/b"))
        return buffer.getvalue()

    assert list(walk(tmp_path / "a", packed(b"V"))) == ["a/b"]
    with pytest.raises(DataError, match="--hard-dereference"):
        walk(tmp_path / "a", packed(tarfile.LNKTYPE))


@pytest.mark.parametrize("size", [b"9" * 5000, b"9" * 20])
def test_a_pax_size_of_too_many_digits_is_corrupt(tmp_path, size):
    record = b" size=" + size + b"\n"
    record = str(len(record) + 4).encode().rjust(4, b"0") + record
    header = tarfile.TarInfo("pax")
    header.type, header.size = tarfile.XHDTYPE, len(record)
    data = header.tobuf() + record + bytes(-len(record) % 512) + tar_of({"a": b""})
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_CORRUPT


def test_gzip_of_something_else_than_a_tar_is_corrupt(tmp_path):
    assert reason_of(tmp_path / "a", gzip.compress(b"no tar at all" * 100)) is Reason.ARCHIVE_CORRUPT


@pytest.mark.parametrize("keep", [0, 1, 2, 9, 18, 0.2, 0.5, 0.9, -9, -8, -5, -1])
def test_a_cut_archive_is_refused_as_truncated(tmp_path, keep):
    data = gzip.compress(tar_of({f"a/{n}": bytes(str(n), "ascii") * 3000 for n in range(50)}))
    cut = data[: int(keep * len(data)) if isinstance(keep, float) else keep]
    assert reason_of(tmp_path / "a", cut) is Reason.ARCHIVE_TRUNCATED


@pytest.mark.parametrize(
    "blocks",
    [
        1,  # before the content of the first member
        2.5,  # in the padding
        3.2,  # inside of a header
        4,  # at a sample boundary
        len(tar_of(FILES).rstrip(b"\0")) // 512 + 1,  # without the end marker
        len(tar_of(FILES).rstrip(b"\0")) // 512 + 2,  # with half of it
    ],
)
def test_a_tar_that_was_cut_before_it_was_compressed_is_truncated(tmp_path, blocks):
    cut = tar_of(FILES)[: int(512 * blocks)]
    assert reason_of(tmp_path / "a", gzip.compress(cut)) is Reason.ARCHIVE_TRUNCATED


def test_a_flipped_bit_in_the_gzip_checksum_is_corrupt(tmp_path):
    data = bytearray(gzip.compress(tar_of(FILES)))
    data[-6] ^= 1
    assert reason_of(tmp_path / "a", bytes(data)) is Reason.ARCHIVE_CORRUPT


def test_a_flipped_bit_in_a_stored_payload_is_found_by_the_checksum(tmp_path):
    data = bytearray(gzip.compress(tar_of(FILES), 0))
    data[len(data) // 2] ^= 1
    assert reason_of(tmp_path / "a", bytes(data)) is Reason.ARCHIVE_CORRUPT


def test_a_changed_header_byte_is_corrupt(tmp_path):
    data = bytearray(tar_of(FILES))
    data[10] ^= 1
    assert reason_of(tmp_path / "a", gzip.compress(bytes(data))) is Reason.ARCHIVE_CORRUPT


def test_data_behind_the_end_of_the_tar_is_corrupt(tmp_path):
    assert reason_of(tmp_path / "a", gzip.compress(tar_of(FILES) + tar_of(FILES))) is Reason.ARCHIVE_CORRUPT
    assert reason_of(tmp_path / "a", gzip.compress(tar_of(FILES)) + b"garbage" * 10) is Reason.ARCHIVE_CORRUPT


@pytest.mark.parametrize("name", ["../evil", "scene/../../evil", "/etc/passwd", "scene/.."])
@pytest.mark.parametrize("kind", FORMATS)
def test_paths_that_leave_the_archive_are_unsafe(tmp_path, name, kind):
    data = gzip.compress(tar_of({"scene/good": b"1", name: b"2"}, kind))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_UNSAFE_MEMBER


@pytest.mark.parametrize(
    "kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.BLKTYPE, tarfile.FIFOTYPE, b"S", b"?"]
)
def test_links_devices_and_unknown_kinds_are_unsafe(tmp_path, kind):
    data = gzip.compress(tar_of({"scene/link": b""}, type=kind, linkname="scene/file"))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_UNSAFE_MEMBER


def test_a_long_link_target_is_unsafe_too(tmp_path):
    data = gzip.compress(tar_of({"scene/link": b""}, "gnu", type=tarfile.SYMTYPE, linkname="t" * 200))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_UNSAFE_MEMBER


def test_pax_sparse_files_are_unsafe(tmp_path):
    data = gzip.compress(tar_of({"scene/s": b"x"}, pax_headers={"GNU.sparse.major": "1"}))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_UNSAFE_MEMBER


def test_a_negative_size_is_corrupt_and_not_walked_backwards(tmp_path):
    data = gzip.compress(tar_of({"scene/s": b"x"}, pax_headers={"size": "-512"}))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_CORRUPT


def test_a_huge_promised_size_is_truncated_and_allocates_nothing(tmp_path):
    data = gzip.compress(tar_of({"scene/s": b"x"}, pax_headers={"size": str(1 << 60)}))
    assert reason_of(tmp_path / "a", data) is Reason.ARCHIVE_TRUNCATED


@given(
    sizes=st.lists(st.integers(0, 3000), max_size=12),
    kind=st.sampled_from(list(FORMATS)),
    cut=st.floats(0, 1, exclude_max=True),
)
def test_any_archive_is_read_back_and_any_cut_of_it_refused(tmp_path_factory, sizes, kind, cut):
    path = tmp_path_factory.getbasetemp() / "property.tar.gz"
    files = {f"scene/{n}": bytes([n + 1]) * size for n, size in enumerate(sizes)}
    data = gzip.compress(tar_of(files, kind))
    assert walk(path, data) == files
    assert reason_of(path, data[: int(cut * len(data))]) is Reason.ARCHIVE_TRUNCATED
