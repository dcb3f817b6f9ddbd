import io

import numpy as np
import pytest
import trimesh

from wsm_data.errors import DataError, Reason
from wsm_data.readers.ply import read_point_cloud, require_finite_points
from wsm_data.schema.point_cloud import PointCloud

XYZ = np.random.default_rng(3).uniform(-9, 9, (40, 3)).astype(np.float32)
RGB = np.random.default_rng(4).integers(0, 256, (40, 3), dtype=np.uint8)
COLOURS = [("red", "u1"), ("green", "u1"), ("blue", "u1")]
SPELLED = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}


def ply(fields, encoding="binary_little_endian", count=None, xyz=XYZ, newline="\n", extra="", body_after=b""):
    """A PLY file with the given vertex fields, written by hand."""
    order = ">" if encoding == "binary_big_endian" else "<"
    rows = np.zeros(len(xyz), [(name, f"{order}{code}") for name, code in fields])
    values = dict(zip("xyz", xyz.T, strict=True)) | dict(zip(("red", "green", "blue"), RGB.T, strict=True))
    for name in set(values) & {name for name, _ in fields}:
        rows[name] = values[name][: len(xyz)]
    count = len(xyz) if count is None else count
    lines = ["ply", f"format {encoding} 1.0", "comment end_header is below", f"element vertex {count}"]
    lines += [f"property {SPELLED[code]} {name}" for name, code in fields]
    header = newline.join([*lines, *([extra] if extra else []), "end_header"]) + newline
    if encoding == "ascii":
        body = "".join(" ".join(repr(value.item()) for value in row) + "\n" for row in rows).encode()
    else:
        body = rows.tobytes()
    return header.encode() + body + body_after


def position(code="f4"):
    return [(axis, code) for axis in "xyz"]


def reason_of(data):
    with pytest.raises(DataError) as caught:
        read_point_cloud(data)
    return caught.value.reason


LAYOUTS = {
    "plain": [*position(), *COLOURS],
    "normals": [*position(), ("nx", "f4"), ("ny", "f4"), ("nz", "f4"), *COLOURS, ("alpha", "u1")],
    "colours first": [*COLOURS, ("label", "i4"), *position()],
    "scattered": [("x", "f4"), ("red", "u1"), ("y", "f4"), ("blue", "u1"), ("z", "f4"), ("green", "u1")],
    "doubles": [*position("f8"), *COLOURS],
}


@pytest.mark.parametrize("encoding", ["binary_little_endian", "binary_big_endian", "ascii"])
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_every_encoding_and_order_of_fields_gives_the_same_points(encoding, layout, newline):
    cloud = read_point_cloud(ply(LAYOUTS[layout], encoding, newline=newline))
    assert np.array_equal(cloud.xyz_m, XYZ)
    assert np.array_equal(cloud.rgb_u8, RGB)


def test_trimesh_reads_the_same(build):
    data = build.cloud(200)
    reference = trimesh.load(io.BytesIO(data), file_type="ply")
    cloud = read_point_cloud(data)
    assert np.array_equal(cloud.xyz_m, np.asarray(reference.vertices, np.float32))
    assert np.array_equal(cloud.rgb_u8, np.asarray(reference.colors)[:, :3])


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_what_trimesh_writes_is_read(encoding):
    mesh = trimesh.PointCloud(XYZ, colors=RGB)
    name = "ascii" if encoding == "ascii" else "binary"
    cloud = read_point_cloud(mesh.export(file_type="ply", encoding=name))
    assert np.allclose(cloud.xyz_m, XYZ, atol=1e-6)  # ASCII keeps eight digits
    assert np.array_equal(cloud.rgb_u8, RGB)


def test_little_endian_bytes_are_not_copied():
    data = ply(LAYOUTS["normals"])
    cloud = read_point_cloud(data)
    start = np.frombuffer(data, np.uint8).__array_interface__["data"][0]
    for array in (cloud.xyz_m, cloud.rgb_u8):
        assert start < array.__array_interface__["data"][0] < start + len(data)


def test_a_path_is_memory_mapped(tmp_path):
    path = tmp_path / "cloud.ply"
    path.write_bytes(ply(LAYOUTS["plain"]))
    cloud = read_point_cloud(path)
    assert np.array_equal(cloud.xyz_m, XYZ)
    base = cloud.xyz_m
    while isinstance(base, np.ndarray) and base.base is not None and not isinstance(base, np.memmap):
        base = base.base if isinstance(base.base, np.ndarray) else base.base.obj
    assert isinstance(base, np.memmap)


def test_faces_behind_the_vertices_do_not_matter():
    faces = "element face 1\nproperty list uchar int vertex_indices"
    data = ply(LAYOUTS["plain"], extra=faces, body_after=b"\x03" + bytes(12))
    assert np.array_equal(read_point_cloud(data).xyz_m, XYZ)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("count", [41, 10**6, 10**11, 2**63, 10**40])
def test_a_count_larger_than_the_file_is_refused_before_anything_is_allocated(encoding, count):
    data = ply(LAYOUTS["plain"], encoding, count=count)
    assert reason_of(data) is Reason.CLOUD_HEADER


def test_a_huge_count_of_faces_is_refused_too():
    faces = "element face 99999999999\nproperty list uchar int vertex_indices"
    assert reason_of(ply(LAYOUTS["plain"], extra=faces)) is Reason.CLOUD_HEADER


def test_a_cut_body_is_refused():
    assert reason_of(ply(LAYOUTS["plain"])[:-1]) is Reason.CLOUD_HEADER


def test_a_cloud_without_points_is_empty(tmp_path):
    assert reason_of(ply(LAYOUTS["plain"], xyz=XYZ[:0])) is Reason.CLOUD_EMPTY


def test_an_empty_file_is_unreadable(tmp_path):
    (tmp_path / "empty.ply").write_bytes(b"")
    assert reason_of(tmp_path / "empty.ply") is Reason.CLOUD_UNREADABLE
    assert reason_of(b"") is Reason.CLOUD_UNREADABLE


@pytest.mark.parametrize(
    "fields", [[("x", "f4"), ("y", "f4"), *COLOURS], [("x", "i4"), ("y", "f4"), ("z", "f4"), *COLOURS]]
)
def test_a_cloud_without_positions_is_unreadable(fields):
    assert reason_of(ply(fields)) is Reason.CLOUD_UNREADABLE


def test_a_cloud_without_colours_has_no_obstacles():
    assert reason_of(ply(position())) is Reason.CLOUD_NO_OBSTACLES


def test_a_field_named_twice_is_a_bad_header():
    header = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\nend_header\n1 2\n"
    assert reason_of(header) is Reason.CLOUD_HEADER


def test_a_line_that_is_not_numbers_is_unreadable():
    data = ply(LAYOUTS["plain"], "ascii").replace(b"end_header\n", b"end_header\nnot a number line\n", 1)
    assert reason_of(data) is Reason.CLOUD_UNREADABLE


def test_points_that_are_not_finite_are_refused():
    xyz = XYZ.copy()
    xyz[7, 1] = np.nan
    with pytest.raises(DataError) as caught:
        require_finite_points(PointCloud(xyz_m=xyz, rgb_u8=RGB))
    assert caught.value.reason is Reason.CLOUD_UNREADABLE
    assert caught.value.details == {"points": 40, "not_finite": 1}
    require_finite_points(PointCloud(xyz_m=XYZ, rgb_u8=RGB))
