"""Where the members of a clip stand in a tar: computed from the key and the axes, never searched for."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from types import MappingProxyType

import numpy as np

from wsm_data.schema.clip import MEMBERS, META_MEMBER
from wsm_data.shards.tar_format import NPY_HEADER_BYTES, member_header, npy_header, padded

META = META_MEMBER.removesuffix(".json")
MEMBER_NAMES = (*MEMBERS, META)
"""Members in stored order; `meta` is `meta.json`, the others are npy files."""

STORED_DTYPES: Mapping[str, np.dtype[np.generic]] = MappingProxyType(
    {name: dtype.newbyteorder("<") for name, (dtype, _) in MEMBERS.items()}
)
"""Dtype of each array as it stands in the file: little-endian."""


@dataclass(frozen=True, kw_only=True)
class Member:
    """One file of a clip. Offsets count from the first byte of the clip.

    Attributes:
        name: `rgb_latent`, ..., `meta`.
        header_offset: first byte of its tar header, which may take more than one block.
        data_offset: first byte of the file.
        data_size: bytes of the file.
        array_offset: first byte of what the checksum covers: the array without its npy header, 64-byte aligned;
            equal to `data_offset` for `meta`.
        array_size: bytes of what the checksum covers.
        dtype: numpy dtype string of the array, empty for `meta`.
        shape: shape of the array, empty for `meta`.
        checksum: xxh3_64 of the `array_size` bytes at `array_offset`, in hexadecimal.
    """

    name: str
    header_offset: int
    data_offset: int
    data_size: int
    array_offset: int
    array_size: int
    dtype: str
    shape: tuple[int, ...]
    checksum: str

    @property
    def file_name(self) -> str:
        """What follows the key and a dot in the tar."""
        return META_MEMBER if self.name == META else f"{self.name}.npy"

    @property
    def end_offset(self) -> int:
        """First byte after the member and its padding."""
        return self.data_offset + padded(self.data_size)


def shape_of(name: str, axes: Mapping[str, int]) -> tuple[int, ...]:
    """Shape of an array member, from the lengths of the axes F, C, h, w, T, Y, X."""
    return tuple(7 if axis == "7" else axes[axis] for axis in MEMBERS[name][1])


def axes_of(arrays: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Lengths of the axes F, C, h, w, T, Y, X of a clip's arrays."""
    lengths: dict[str, int] = {}
    for name, array in arrays.items():
        axes = MEMBERS[name][1]
        lengths.update({axis: length for axis, length in zip(axes, array.shape, strict=True) if axis != "7"})
    return lengths


def lay_out(key: str, *, axes: Mapping[str, int], meta_size: int, checksums: Mapping[str, str]) -> tuple[Member, ...]:
    """Members of a clip, those that have a checksum: equal arguments, equal places, in every release."""
    members: list[Member] = []
    offset = 0
    for name in (one for one in MEMBER_NAMES if one in checksums):
        member = _place(key, name, axes=axes, meta_size=meta_size, checksum=checksums[name], offset=offset)
        members.append(member)
        offset = member.end_offset
    return tuple(members)


def header_bytes(key: str, member: Member) -> bytes:
    """The bytes from `header_offset` to `array_offset`: tar header, and npy header of an array."""
    if member.name == META:
        return member_header(f"{key}.{member.file_name}", member.data_size)
    return array_header(key, member.name, member.shape)


def array_header(key: str, name: str, shape: tuple[int, ...]) -> bytes:
    """Tar header and npy header of an array member."""
    size = prod(shape) * STORED_DTYPES[name].itemsize
    return member_header(f"{key}.{name}.npy", NPY_HEADER_BYTES + size) + npy_header(STORED_DTYPES[name], shape)


def _place(key: str, name: str, *, axes: Mapping[str, int], meta_size: int, checksum: str, offset: int) -> Member:
    is_array = name != META
    shape = shape_of(name, axes) if is_array else ()
    size = int(np.prod(shape, dtype=np.int64)) * STORED_DTYPES[name].itemsize if is_array else meta_size
    npy_bytes = NPY_HEADER_BYTES if is_array else 0
    file_name = f"{name}.npy" if is_array else META_MEMBER
    data_offset = offset + len(member_header(f"{key}.{file_name}", npy_bytes + size))
    return Member(
        name=name,
        header_offset=offset,
        data_offset=data_offset,
        data_size=npy_bytes + size,
        array_offset=data_offset + npy_bytes,
        array_size=size,
        dtype=STORED_DTYPES[name].str if is_array else "",
        shape=shape,
        checksum=checksum,
    )
