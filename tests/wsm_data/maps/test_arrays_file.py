import numpy as np
import pytest

from wsm_data.errors import IntegrityError
from wsm_data.maps.arrays_file import arrays_digest, load_arrays, save_arrays


def some_arrays():
    return {"a": np.arange(6, dtype=np.int16).reshape(2, 3), "b": np.array([True, False]), "empty": np.zeros((0, 3))}


def test_arrays_come_back_as_they_were(tmp_path):
    save_arrays(tmp_path / "x.npz", some_arrays())
    loaded = load_arrays(tmp_path / "x.npz", ["a", "b", "empty"])
    for name, array in some_arrays().items():
        assert loaded[name].dtype == array.dtype
        assert np.array_equal(loaded[name], array)


def test_equal_arrays_give_equal_bytes(tmp_path):
    save_arrays(tmp_path / "x.npz", some_arrays())
    save_arrays(tmp_path / "y.npz", some_arrays())
    assert (tmp_path / "x.npz").read_bytes() == (tmp_path / "y.npz").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.npz", "y.npz"]  # nothing temporary is left


@pytest.mark.parametrize("keep", [0, 10, 200, -30])
def test_a_cut_file_is_an_integrity_error_that_names_it(tmp_path, keep):
    save_arrays(tmp_path / "x.npz", some_arrays())
    (tmp_path / "x.npz").write_bytes((tmp_path / "x.npz").read_bytes()[:keep])
    with pytest.raises(IntegrityError, match=r"x\.npz"):
        load_arrays(tmp_path / "x.npz", ["a", "b", "empty"])


def test_any_changed_byte_changes_nothing_or_is_an_integrity_error(tmp_path):
    save_arrays(tmp_path / "x.npz", some_arrays())
    data = (tmp_path / "x.npz").read_bytes()
    refused = 0
    for position in range(len(data)):
        changed = bytearray(data)
        changed[position] ^= 0x11
        (tmp_path / "x.npz").write_bytes(changed)
        try:
            loaded = load_arrays(tmp_path / "x.npz", ["a", "b", "empty"])
        except IntegrityError:
            refused += 1
        else:  # names and times that stand twice in a zip are read once
            assert arrays_digest(loaded) == arrays_digest(some_arrays())
    assert refused > len(data) / 2


def test_pickled_objects_are_not_loaded(tmp_path):
    np.savez(tmp_path / "x.npz", a=np.array([{"an": "object"}], dtype=object))
    with pytest.raises(IntegrityError, match="allow_pickle=False"):
        load_arrays(tmp_path / "x.npz", ["a"])


def test_a_file_with_other_names_is_refused(tmp_path):
    save_arrays(tmp_path / "x.npz", some_arrays())
    with pytest.raises(IntegrityError, match="must hold the arrays"):
        load_arrays(tmp_path / "x.npz", ["a", "b"])


def test_a_missing_file_is_a_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_arrays(tmp_path / "x.npz", ["a"])


def test_the_digest_sees_names_dtypes_shapes_and_bytes():
    a = np.arange(4, dtype=np.int32)
    digests = {
        arrays_digest(arrays)
        for arrays in (
            {"a": a},
            {"b": a},
            {"a": a.astype(np.uint32)},
            {"a": a.reshape(2, 2)},
            {"a": a + 1},
            {"a": a[:0]},
        )
    }
    assert len(digests) == 6
    assert arrays_digest({"a": a, "b": a}) == arrays_digest({"b": a, "a": a.copy()})
