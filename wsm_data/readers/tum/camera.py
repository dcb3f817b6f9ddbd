"""The camera of a sequence: its own file, or what is published about the camera that its folder names."""

from pathlib import Path

import numpy as np

from wsm_data.errors import DataError, Reason
from wsm_data.readers.tum.listing import data_lines, unreadable
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CameraModel, DatasetManifest


def camera_name(sequence: str, dataset: DatasetManifest) -> str:
    """Name of the camera of a sequence: the published one whose name stands in the sequence's, or the only one.

    `own` where neither is, so that a file of the sequence must say what its camera is.
    """
    named = [name for name in dataset.cameras if name in sequence]
    if named:
        return max(named, key=len)
    return next(iter(dataset.cameras)) if len(dataset.cameras) == 1 else "own"


def read_intrinsics(
    folder: Path, camera: str, size: tuple[int, int], dataset: DatasetManifest, where: str
) -> Intrinsics:
    """Intrinsics of a sequence at the size of its images, (width, height): its own, or else the published ones.

    Raises:
        DataError: `sequence.unreadable` where neither is there, or the file is no camera; `intrinsics.misfit` where
            they belong to other images.
    """
    name = dataset.files.camera
    if name and (folder / name).exists():
        fx, fy, cx, cy = _from_file(folder, name, where)
    else:
        fx, fy, cx, cy = _published(camera, size, dataset, where)
    try:
        return Intrinsics(fx=fx, fy=fy, cx=cx, cy=cy, width=size[0], height=size[1])
    except ValueError as error:
        raise DataError(Reason.INTRINSICS_MISFIT, f"{where}: {error}", {"fx": fx, "fy": fy, "cx": cx, "cy": cy}) from (
            error
        )


def _from_file(folder: Path, name: str, where: str) -> tuple[float, float, float, float]:
    words = [word for _, line in data_lines(folder, name, where) for word in line]
    try:
        values = np.array([float(word) for word in words])
    except ValueError as error:
        raise unreadable(where, f"{name} holds a word that is no number: {error}") from error
    if len(values) in (9, 16):
        K = values.reshape(round(len(values) ** 0.5), -1)
        values = K[[0, 1, 0, 1], [0, 1, 2, 2]]
    if len(values) != 4:
        raise unreadable(where, f"{name} must hold fx fy cx cy or a 3 x 3 or 4 x 4 matrix, found {len(values)} numbers")
    fx, fy, cx, cy = values.tolist()
    return fx, fy, cx, cy


def _published(
    camera: str, size: tuple[int, int], dataset: DatasetManifest, where: str
) -> tuple[float, float, float, float]:
    model = dataset.cameras.get(camera, CameraModel())
    values = model.fx, model.fy, model.cx, model.cy
    if (model.width, model.height) != size or None in values:
        raise unreadable(
            where,
            f"the sequence must have {dataset.files.camera or 'a camera file'}, or a published camera in the manifest "
            f"({', '.join(dataset.cameras) or 'there is none'}) for images of {size[0]} x {size[1]} px, found {model}",
        )
    fx, fy, cx, cy = (float(value) for value in values if value is not None)
    return fx, fy, cx, cy
