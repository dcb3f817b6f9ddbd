"""Do the intrinsics belong to the images?"""

from collections.abc import Mapping

import numpy as np

from wsm_data.checks.limits import verdict_within
from wsm_data.errors import Reason
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CameraModel
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.source.check_limits import CheckLimits
from wsm_data.schema.verdict import Verdict

MIN_FIELD_OF_VIEW_DEG = 30.0
"""Narrowest horizontal field of view of a camera that sees where it drives, degrees."""

MAX_ASPECT_ERROR = 0.05
"""Largest |fx / fy - 1|; the published d435i has 0.012."""


def check_intrinsics_fit(record: EpisodeRecord, cameras: Mapping[str, CameraModel], checks: CheckLimits) -> Verdict:
    """Refuse intrinsics that cannot belong to the images, or are not the published camera's (`intrinsics.misfit`).

    Args:
        record: the trajectory.
        cameras: published camera models by camera name.
        checks: limits of the source.
    """
    intrinsics = record.intrinsics
    limits = {
        "centre_offset": (_centre_offset(intrinsics), 0.0, checks.max_centre_offset),
        "field_of_view_deg": (
            float(np.rad2deg(2 * np.arctan2(intrinsics.width / 2, intrinsics.fx))),
            MIN_FIELD_OF_VIEW_DEG,
            checks.max_field_of_view_deg,
        ),
        "aspect_error": (abs(intrinsics.fx / intrinsics.fy - 1), 0.0, MAX_ASPECT_ERROR),
    }
    published = cameras.get(record.id.camera)
    if published is not None and (published.width, published.height) == (intrinsics.width, intrinsics.height):
        error = _published_error(intrinsics, published)
        limits["published_error"] = (error, 0.0, checks.max_published_error)
    return verdict_within(limits, Reason.INTRINSICS_MISFIT, f"{record.id.text}: {intrinsics} does not fit the images")


def _centre_offset(intrinsics: Intrinsics) -> float:
    """Distance of the principal point from the image centre along the worse axis, as a share of the side."""
    x = abs((intrinsics.cx + 0.5) / intrinsics.width - 0.5)
    y = abs((intrinsics.cy + 0.5) / intrinsics.height - 0.5)
    return max(x, y)


def _published_error(intrinsics: Intrinsics, published: CameraModel) -> float:
    """Largest relative deviation from what is published; 0 where nothing is."""
    scales = {"fx": intrinsics.fx, "fy": intrinsics.fy, "cx": intrinsics.width, "cy": intrinsics.height}
    errors = [0.0]
    for name, scale in scales.items():
        value = getattr(published, name)
        if value is not None:
            errors.append(abs(getattr(intrinsics, name) - value) / scale)
    return max(errors)
