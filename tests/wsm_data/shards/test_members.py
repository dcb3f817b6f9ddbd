from collections.abc import Callable
from itertools import pairwise

import pytest

from wsm_data.schema.clip import MEMBERS, Clip
from wsm_data.shards.members import MEMBER_NAMES, axes_of, header_bytes, lay_out, shape_of

CHECKSUMS = dict.fromkeys(MEMBER_NAMES, "0" * 16)
AXES = {"F": 3, "C": 48, "h": 6, "w": 10, "T": 9, "Y": 11, "X": 13}


def test_members_stand_in_the_order_of_the_format_one_after_the_other() -> None:
    members = lay_out("a/b/c", axes=AXES, meta_size=700, checksums=CHECKSUMS)
    assert [member.file_name for member in members] == [*(f"{name}.npy" for name in MEMBERS), "meta.json"]
    assert members[0].header_offset == 0
    for first, second in pairwise(members):
        assert first.end_offset == second.header_offset


@pytest.mark.parametrize("key", ["a/b/c", "/".join(["a" * 100, "b" * 100, "c" * 53])], ids=["short", "long"])
def test_every_array_starts_at_a_multiple_of_64_bytes(key: str) -> None:
    members = lay_out(key, axes=AXES, meta_size=700, checksums=CHECKSUMS)
    assert [member.array_offset % 64 for member in members] == [0] * len(members)


def test_the_header_bytes_lead_from_the_header_to_the_array() -> None:
    for member in lay_out("a/b/c", axes=AXES, meta_size=700, checksums=CHECKSUMS):
        assert len(header_bytes("a/b/c", member)) == member.array_offset - member.header_offset


def test_sizes_are_those_of_the_arrays(make_clip: Callable[..., Clip]) -> None:
    clip = make_clip()
    axes = axes_of(clip.arrays())
    for member in lay_out("a/b/c", axes=axes, meta_size=1, checksums=CHECKSUMS)[:-1]:
        array = clip.arrays()[member.name]
        assert (member.array_size, member.shape, member.data_size) == (array.nbytes, array.shape, array.nbytes + 128)
        assert shape_of(member.name, axes) == array.shape


def test_the_documentation_lists_every_member_with_its_dtype_and_axes(
    words_of_table: Callable[[str], list[str]], format_document: str
) -> None:
    assert words_of_table("## A clip") == [*(f"{name}.npy" for name in MEMBERS), "meta.json"]
    for name, (dtype, axes) in MEMBERS.items():
        assert f"| `{name}.npy` | {dtype} | {', '.join(axes)} |" in format_document
