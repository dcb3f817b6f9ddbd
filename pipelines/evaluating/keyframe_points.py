"""Points as SLAM-Former leaves them for every keyframe: `final_pc/ID.npz`."""

from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, IntegrityError, Reason
from wsm_data.maps.arrays_file import load_arrays
from wsm_data.schema.arrays import Float64Array, Uint8Array
from wsm_data.schema.point_cloud import PointCloud

POINTS_FOLDER = "final_pc"


def read_keyframe_points(folder: Path) -> PointCloud:
    """Points of all keyframes, in the order of their numbers, where `mask` is true.

    Args:
        folder: of files `ID.npz` with `pointcloud` [H, W, 3], `mask` [H, W] bool and `color` [H, W, 3] in 0 to 1.

    Raises:
        DataError: `cloud.missing` without a file; `cloud.unreadable` for a file that is no such one, or whose name is
            no number; `cloud.empty` where no mask leaves a point.
    """
    files = sorted(folder.glob("*.npz"), key=_number)
    if not files:
        raise DataError(Reason.CLOUD_MISSING, f"{folder} must hold files ID.npz, found none", {"folder": folder})
    parts = [_masked_points(path) for path in files]
    xyz_m, rgb_u8 = (np.concatenate(some) for some in zip(*parts, strict=True))
    if not len(xyz_m):
        message = f"the masks of {len(files)} files in {folder} must leave points, and leave none"
        raise DataError(Reason.CLOUD_EMPTY, message, {"folder": folder, "files": len(files)})
    return PointCloud(xyz_m=xyz_m.astype(np.float32), rgb_u8=rgb_u8)


def _number(path: Path) -> float:
    try:
        return float(path.stem)
    except ValueError:
        raise _unreadable(path, "its name must be the number of a keyframe") from None


def _masked_points(path: Path) -> tuple[Float64Array, Uint8Array]:
    try:
        found = load_arrays(path, ("pointcloud", "mask", "color"))
    except IntegrityError as error:
        raise _unreadable(path, str(error)) from error
    points, mask, colours = found["pointcloud"], found["mask"], found["color"]
    if mask.dtype != np.bool_ or mask.ndim != 2 or not points.shape == colours.shape == (*mask.shape, 3):
        raise _unreadable(
            path,
            f"pointcloud and color must be [H, W, 3] and mask bool [H, W], found {points.shape}, "
            f"{colours.shape} and {mask.dtype} {mask.shape}",
        )
    kept = colours[mask]
    if points.dtype.kind != "f" or kept.dtype.kind != "f" or not ((kept >= 0) & (kept <= 1)).all():
        raise _unreadable(path, "pointcloud must be float, and color float from 0 to 1")
    return points[mask].astype(np.float64), np.rint(kept * 255).astype(np.uint8)


def _unreadable(path: Path, why: str) -> DataError:
    return DataError(Reason.CLOUD_UNREADABLE, f"{path} cannot be read as a keyframe's points: {why}", {"file": path})
