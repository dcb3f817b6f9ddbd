"""Coloured point clouds in PLY files, without a copy where the file allows it."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from wsm_data.errors import DataError, Reason
from wsm_data.readers.ply_header import PlyElement, PlyHeader, parse_ply_header
from wsm_data.schema.arrays import BoolArray
from wsm_data.schema.point_cloud import PointCloud

_Scalar = TypeVar("_Scalar", np.float32, np.uint8)

_BYTE_ORDER = {"binary_little_endian": "<", "binary_big_endian": ">"}
_POSITION = ("x", "y", "z")
_COLOUR = ("red", "green", "blue")


def read_point_cloud(data: bytes | memoryview | Path) -> PointCloud:
    """Read the vertices of a PLY file.

    A little-endian file with float positions costs nothing: the result is a strided view into the bytes, or into a
    memory map of the file where a path is given. Big-endian, ASCII and double positions are converted to float32.

    Args:
        data: the bytes, which must then stay as they are; or the path of a file.

    Raises:
        DataError: `cloud.unreadable`, `cloud.header` when the header is malformed or promises more than there is,
            `cloud.empty` when it has no point, `cloud.no_obstacles` when its points have no colour.
    """
    view = _mapped(data) if isinstance(data, Path) else memoryview(data)
    header = parse_ply_header(view)
    vertices = _vertex_element(header)
    rows = _ascii_rows(view, header, vertices) if header.encoding == "ascii" else _binary_rows(view, header, vertices)
    return PointCloud(xyz_m=_columns(rows, _POSITION, np.float32), rgb_u8=_columns(rows, _COLOUR, np.uint8))


def _mapped(path: Path) -> memoryview:
    if path.stat().st_size == 0:  # a map must not be empty
        return memoryview(b"")
    return memoryview(np.memmap(path, np.uint8, "r"))


def require_finite_points(cloud: PointCloud) -> None:
    """Check that every position is a number.

    Raises:
        DataError: `cloud.unreadable`.
    """
    finite: BoolArray = np.isfinite(cloud.xyz_m)
    if not finite.all():
        bad = int(np.count_nonzero(~finite.all(axis=1)))
        message = f"the positions of a cloud must be finite, and {bad} of {len(finite)} points are not"
        raise DataError(Reason.CLOUD_UNREADABLE, message, {"points": len(finite), "not_finite": bad})


def _vertex_element(header: PlyHeader) -> PlyElement:
    """The vertices, which must have positions and colours and stand first: what comes before has no fixed size."""
    if not header.elements or header.elements[0].name != "vertex" or header.elements[0].has_lists:
        found = ", ".join(element.name for element in header.elements) or "nothing"
        raise DataError(Reason.CLOUD_UNREADABLE, f"a cloud starts with vertices of scalar properties, found {found}")
    vertices = header.elements[0]
    types = dict(vertices.properties)
    if vertices.count == 0:
        raise DataError(Reason.CLOUD_EMPTY, "a cloud must have points, found none", {"points": 0})
    if len(types) != len(vertices.properties):
        raise DataError(Reason.CLOUD_HEADER, "the PLY header names a property of the vertices twice")
    if any(types.get(name) not in ("f4", "f8") for name in _POSITION):
        message = f"vertices must have x, y and z as float or double, found {_spelled(types)}"
        raise DataError(Reason.CLOUD_UNREADABLE, message)
    if any(types.get(name) != "u1" for name in _COLOUR):
        message = (
            f"vertices must have red, green and blue as uchar to tell obstacles from surface, found {_spelled(types)}"
        )
        raise DataError(Reason.CLOUD_NO_OBSTACLES, message)
    return vertices


def _spelled(types: dict[str, str | None]) -> str:
    return ", ".join(f"{name} {code}" for name, code in types.items())


def _binary_rows(view: memoryview, header: PlyHeader, vertices: PlyElement) -> NDArray[np.void]:
    order = _BYTE_ORDER[header.encoding]
    dtype = np.dtype([(name, f"{order}{code}") for name, code in vertices.properties])
    return np.frombuffer(view, dtype, vertices.count, header.body_start)


def _ascii_rows(view: memoryview, header: PlyHeader, vertices: PlyElement) -> NDArray[np.void]:
    dtype = np.dtype([(name, f"<{code}") for name, code in vertices.properties])
    try:
        rows = np.loadtxt(io.BytesIO(view[header.body_start :]), dtype, max_rows=vertices.count, comments=None, ndmin=1)
    except (ValueError, OverflowError) as error:
        raise DataError(Reason.CLOUD_UNREADABLE, f"an ASCII cloud has a line that cannot be read: {error}") from error
    if len(rows) != vertices.count:
        message = f"the header promises {vertices.count} points, found {len(rows)}; download it again"
        raise DataError(Reason.CLOUD_HEADER, message, {"promised": vertices.count, "found": len(rows)})
    return rows


def _columns(rows: NDArray[np.void], names: tuple[str, ...], dtype: type[_Scalar]) -> NDArray[_Scalar]:
    """Three fields as one [N, 3] array: a view where they lie side by side in the wanted type, else a copy."""
    fields: Mapping[str, Sequence[Any]] = rows.dtype.fields or {}
    size = np.dtype(dtype).itemsize
    first = fields[names[0]][1]
    side_by_side = all(tuple(fields[name][:2]) == (np.dtype(dtype), first + i * size) for i, name in enumerate(names))
    if side_by_side:
        packed = np.dtype(
            {"names": ["v"], "formats": [(dtype, (3,))], "offsets": [first], "itemsize": rows.dtype.itemsize}
        )
        return rows.view(packed)["v"]
    return np.stack([rows[name].astype(dtype) for name in names], axis=1)
