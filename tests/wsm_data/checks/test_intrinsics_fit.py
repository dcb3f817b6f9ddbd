import dataclasses

import pytest

from wsm_data.checks.intrinsics_fit import check_intrinsics_fit
from wsm_data.errors import Reason
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CameraModel
from wsm_data.schema.source.check_limits import CheckLimits


def verdict_of(make_record, dataset, **changes):
    record = make_record()
    changed = make_record(intrinsics=dataclasses.replace(record.intrinsics, **changes))
    return check_intrinsics_fit(changed, dataset.cameras, dataset.checks)


def test_the_published_camera_fits(make_record, dataset):
    verdict = check_intrinsics_fit(make_record(), dataset.cameras, dataset.checks)
    assert verdict.keep
    assert verdict.measured["published_error"] == 0
    assert verdict.measured["field_of_view_deg"] == pytest.approx(68.0, abs=0.1)  # 2 atan(240 / 355.81)


@pytest.mark.parametrize("change", [{"fx": 380.0}, {"fy": 370.0}, {"cx": 262.0}, {"cy": 147.0}])
def test_deviations_from_the_published_camera_are_refused(make_record, dataset, change):
    verdict = verdict_of(make_record, dataset, **change)
    assert verdict.reason is Reason.INTRINSICS_MISFIT
    assert "published_error" in verdict.message


@pytest.mark.parametrize("change", [{"fx": 358.0}, {"cx": 243.0}])
def test_a_calibration_within_a_few_per_cent_is_kept(make_record, dataset, change):
    assert verdict_of(make_record, dataset, **change).keep


@pytest.mark.parametrize(
    ("intrinsics", "what"),
    [
        (Intrinsics(fx=476.6, fy=476.6, cx=319.5, cy=179.5, width=480, height=270), "centre_offset"),  # of 640 x 360
        (Intrinsics(fx=60.0, fy=60.0, cx=320.0, cy=180.0, width=640, height=360), "field_of_view_deg"),
        (Intrinsics(fx=4000.0, fy=4000.0, cx=320.0, cy=180.0, width=640, height=360), "field_of_view_deg"),
        (Intrinsics(fx=476.0, fy=600.0, cx=320.0, cy=180.0, width=640, height=360), "aspect_error"),
    ],
)
def test_an_implausible_camera_is_refused_without_a_published_one(make_record, intrinsics, what):
    verdict = check_intrinsics_fit(make_record(intrinsics=intrinsics), {}, CheckLimits())
    assert verdict.reason is Reason.INTRINSICS_MISFIT
    assert what in verdict.message


def test_a_published_camera_of_another_size_or_without_numbers_says_nothing(make_record, dataset):
    halved = make_record(intrinsics=make_record().intrinsics.resized(240, 135))
    assert "published_error" not in check_intrinsics_fit(halved, dataset.cameras, dataset.checks).measured
    sized = {"d435i": CameraModel(width=480, height=270)}
    assert check_intrinsics_fit(make_record(), sized, dataset.checks).measured["published_error"] == 0


@pytest.mark.parametrize(
    ("changes", "limits"),
    [
        ({"fx": 380.0, "fy": 375.0}, {"max_published_error": 0.08}),
        ({"cx": 300.0, "width": 481}, {"max_centre_offset": 0.15}),  # of another size, so that nothing is published
        ({"fx": 80.0, "fy": 80.0, "width": 481}, {"max_field_of_view_deg": 150.0}),  # 2 atan(240.5 / 80) = 143 degrees
    ],
)
def test_another_camera_has_its_limits_in_the_manifest(make_record, dataset, changes, limits):
    record = make_record(intrinsics=dataclasses.replace(make_record().intrinsics, **changes))
    assert not check_intrinsics_fit(record, dataset.cameras, dataset.checks).keep
    assert check_intrinsics_fit(record, dataset.cameras, CheckLimits(**limits)).keep
