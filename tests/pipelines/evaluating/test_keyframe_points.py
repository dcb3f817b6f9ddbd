import numpy as np
import pytest

from pipelines.evaluating.keyframe_points import read_keyframe_points
from wsm_data.errors import DataError
from wsm_data.maps.arrays_file import save_arrays


def keyframe(value, kept=True):
    whole = np.full((2, 3, 3), value, np.float32)
    return {"pointcloud": whole, "mask": np.full((2, 3), kept), "color": np.full((2, 3, 3), 0.2)}


def test_keyframes_come_in_the_order_of_their_numbers_not_of_their_names(tmp_path):
    for number in (10, 2):
        save_arrays(tmp_path / f"{number}.npz", keyframe(number))
    cloud = read_keyframe_points(tmp_path)
    assert cloud.xyz_m[:, 0].tolist() == [2.0] * 6 + [10.0] * 6
    assert (cloud.rgb_u8 == 51).all()  # 0.2 of 255


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("1.npz", {"mask": np.ones((2, 3), np.uint8)}, "cloud.unreadable"),
        ("1.npz", {"pointcloud": np.zeros((2, 4, 3))}, "cloud.unreadable"),
        ("1.npz", {"color": np.full((2, 3, 3), 51.0)}, "cloud.unreadable"),
        ("1.npz", {"more": np.zeros(1)}, "cloud.unreadable"),
        ("last.npz", {}, "cloud.unreadable"),
        ("1.npz", {"mask": np.zeros((2, 3), bool)}, "cloud.empty"),
        ("1.txt", {}, "cloud.missing"),
    ],
)
def test_what_is_no_keyframe_is_refused_by_its_reason(tmp_path, name, change, reason):
    save_arrays(tmp_path / name, keyframe(1) | change)
    with pytest.raises(DataError) as caught:
        read_keyframe_points(tmp_path)
    assert caught.value.reason.value == reason


def test_a_cut_file_is_named(tmp_path):
    save_arrays(tmp_path / "3.npz", keyframe(1))
    data = (tmp_path / "3.npz").read_bytes()
    (tmp_path / "3.npz").write_bytes(data[: len(data) // 2])
    with pytest.raises(DataError, match=r"3\.npz") as caught:
        read_keyframe_points(tmp_path)
    assert caught.value.reason.value == "cloud.unreadable"
