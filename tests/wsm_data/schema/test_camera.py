"""Pinhole intrinsics: what is refused, and how they follow a resize."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wsm_data.schema.camera import Intrinsics

D435I = {"fx": 355.81, "fy": 351.69, "cx": 240.0, "cy": 135.0, "width": 480, "height": 270}  # as published

SIZES = st.integers(1, 4000)


@st.composite
def cameras(draw):
    width, height = draw(SIZES), draw(SIZES)
    share = st.floats(0, 1, exclude_max=True)
    focal = st.floats(1, 5000)
    return Intrinsics(
        fx=draw(focal),
        fy=draw(focal),
        cx=draw(share) * (width - 1),
        cy=draw(share) * (height - 1),
        width=width,
        height=height,
    )


def project(camera, point):
    return camera.fx * point[0] / point[2] + camera.cx, camera.fy * point[1] / point[2] + camera.cy


@given(cameras(), SIZES, SIZES, st.floats(-2, 2), st.floats(-2, 2))
def test_projecting_with_resized_intrinsics_is_projecting_and_then_scaling_pixel_areas(camera, width, height, x, y):
    u, v = project(camera, (x, y, 1.0))
    resized_u, resized_v = project(camera.resized(width, height), (x, y, 1.0))
    # a pixel's area spans from u - 1/2 to u + 1/2, so areas scale about the corner of the image at -1/2
    expected_u = (u + 0.5) * width / camera.width - 0.5
    expected_v = (v + 0.5) * height / camera.height - 0.5
    largest = max(abs(expected_u), abs(expected_v), abs(width), abs(height), 1.0)
    tolerance = 1e-12 * largest * (1 + camera.fx + camera.fy)  # float64 rounding of sums of numbers of this size
    assert resized_u == pytest.approx(expected_u, abs=tolerance)
    assert resized_v == pytest.approx(expected_v, abs=tolerance)


@given(cameras(), SIZES, SIZES)
def test_resizing_there_and_back_gives_the_same_camera(camera, width, height):
    back = camera.resized(width, height).resized(camera.width, camera.height)
    np.testing.assert_allclose(back.matrix, camera.matrix, rtol=1e-12, atol=1e-9)


def test_the_field_of_view_does_not_change_with_the_size():
    full, small = Intrinsics(**D435I), Intrinsics(**D435I).resized(320, 192)
    assert (small.width, small.height) == (320, 192)
    assert small.fx / small.width == pytest.approx(full.fx / full.width, rel=1e-15)
    assert small.fy / small.height == pytest.approx(full.fy / full.height, rel=1e-15)


def test_the_centre_of_an_image_stays_its_centre():
    centred = Intrinsics(fx=300.0, fy=300.0, cx=239.5, cy=134.5, width=480, height=270).resized(320, 192)
    assert (centred.cx, centred.cy) == pytest.approx((159.5, 95.5), abs=1e-12)


def test_the_matrix_holds_the_numbers_in_their_places():
    assert Intrinsics(**D435I).matrix.tolist() == [[355.81, 0.0, 240.0], [0.0, 351.69, 135.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize("field", ["fx", "fy", "width", "height"])
@pytest.mark.parametrize("value", [0, -1])
def test_focal_lengths_and_sizes_must_be_positive(field, value):
    with pytest.raises(ValueError, match=f"^{field} must be positive, found {value}"):
        Intrinsics(**{**D435I, field: value})


@pytest.mark.parametrize("field", ["fx", "fy", "cx", "cy"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_must_be_finite(field, value):
    with pytest.raises(ValueError, match=f"^{field} must be finite, found {value}"):
        Intrinsics(**{**D435I, field: value})


@pytest.mark.parametrize("outside", [{"cx": -0.51}, {"cx": 479.5}, {"cy": -0.51}, {"cy": 269.5}, {"width": 240}])
def test_a_principal_point_outside_the_image_is_refused_and_the_cause_suggested(outside):
    with pytest.raises(ValueError, match=r"principal point \(cx, cy\) must lie in .* another image size\?"):
        Intrinsics(**{**D435I, **outside})


@pytest.mark.parametrize("inside", [{"cx": -0.5}, {"cx": 479.49}, {"cy": -0.5}, {"cy": 269.49}])
def test_a_principal_point_at_the_border_of_the_image_is_accepted(inside):
    Intrinsics(**{**D435I, **inside})
