import dataclasses

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wsm_data.errors import IntegrityError
from wsm_data.readers.record_table import read_records, write_records
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.identity import EpisodeId

NUMBERS = st.floats(-1e6, 1e6)


def record(frames=5, seed=0, notes=(), height=0.5):
    return EpisodeRecord(
        id=EpisodeId("g_zed", "scène 1", f"{seed:06d}"),
        container="g_zed/scène 1.tar.gz",
        rgb_members=tuple(f"rgb/{t}.jpg" for t in range(frames)),
        depth_members=tuple(f"depth/{t}.png" for t in range(frames)),
        T_world_camera=np.random.default_rng(seed).normal(size=(frames, 4, 4)),
        intrinsics=Intrinsics(fx=355.81, fy=351.69, cx=240.0, cy=135.0, width=480, height=270),
        camera_height_m=height,
        camera_pitch_rad=0.1,
        frames_digest="f" * 64,
        content_digest="c" * 64,
        notes=notes,
    )


def same(a, b):
    for field in dataclasses.fields(EpisodeRecord):
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert x.tobytes() == y.tobytes() if isinstance(x, np.ndarray) else x == y, field.name
        assert type(x) is type(y)


@settings(max_examples=25)
@given(
    frames=st.integers(1, 9),
    seed=st.integers(0, 99),
    height=NUMBERS,
    notes=st.lists(st.sampled_from(["a.b", "c.d"]), max_size=2),
)
def test_records_come_back_equal_to_the_last_bit(tmp_path_factory, frames, seed, height, notes):
    path = tmp_path_factory.getbasetemp() / "records.parquet"
    records = [record(frames, seed, tuple(notes), height), record(3, seed + 1)]
    write_records(path, records)
    back = read_records(path)
    assert len(back) == 2
    for a, b in zip(records, back, strict=True):
        same(a, b)


def test_the_same_records_give_the_same_bytes(tmp_path):
    write_records(tmp_path / "a", [record(seed=1), record(seed=2)])
    write_records(tmp_path / "b", iter((record(seed=1), record(seed=2))))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_no_records_are_a_table_too(tmp_path):
    write_records(tmp_path / "none", [])
    assert read_records(tmp_path / "none") == ()


@pytest.mark.parametrize("damage", ["absent", "cut", "other table", "impossible record"])
def test_what_is_no_record_table_is_an_integrity_error(tmp_path, damage):
    path = tmp_path / "records"
    write_records(path, [record()])
    if damage == "absent":
        path.unlink()
    elif damage == "cut":
        path.write_bytes(path.read_bytes()[:-30])
    elif damage == "other table":
        pq.write_table(pa.table({"id": ["a/b/c"]}), path)
    else:
        table = pq.read_table(path)
        fx = table.schema.get_field_index("fx")
        pq.write_table(table.set_column(fx, table.schema.field(fx), pa.array([-1.0])), path)
    with pytest.raises(IntegrityError, match="records"):
        read_records(path)
