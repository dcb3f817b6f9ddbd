"""A camera moves sideways along a patterned wall 2 m away: every image is the one before, moved by whole pixels."""

import dataclasses

import numpy as np
import pytest

from wsm_data.checks.colour_agreement import check_colour_agreement
from wsm_data.errors import Reason
from wsm_data.schema.camera import Intrinsics

INTRINSICS = Intrinsics(fx=100.0, fy=100.0, cx=39.5, cy=29.5, width=80, height=60)
SHIFT_PX = 5
STEPS = [(0, 1), (1, 2), (2, 3)]
WALL = np.random.default_rng(0).integers(40, 200, (12, 24, 3)).repeat(5, axis=0).repeat(5, axis=1).astype(np.uint8)
IMAGES = {t: WALL[:, SHIFT_PX * t : SHIFT_PX * t + 80] for t in range(4)}
DEPTH = {t: np.full((60, 80), 2.0, np.float32) for t in range(4)}


@pytest.fixture
def record(make_record):
    """At 2 m and fx = 100, 5 px are 0.1 m."""
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, 0, 3] = 0.1 * np.arange(4)
    return dataclasses.replace(make_record(frames=4), T_world_camera=poses, intrinsics=INTRINSICS)


def check(record, images):
    return check_colour_agreement(record, images, DEPTH, STEPS, 0.6)


def test_images_that_move_with_the_poses_correlate_wholly(record):
    verdict = check(record, IMAGES)
    assert verdict.keep
    assert verdict.measured["colour_steps"] == 3
    assert verdict.measured["rank_correlation"] > 0.99  # ties are ranked by their order


def test_exposure_does_not_count(record):
    darker = {t: (image * (1 - 0.2 * t)).astype(np.uint8) for t, image in IMAGES.items()}
    assert check(record, darker).measured["rank_correlation"] > 0.98


@pytest.mark.parametrize(
    "wrong",
    [
        lambda t: IMAGES[0],
        lambda t: IMAGES[3 - t],
        lambda t: IMAGES[t][:, ::-1],
        lambda t: np.random.default_rng(t).integers(0, 255, (60, 80, 3)).astype(np.uint8),
    ],
    ids=["frozen", "reversed", "mirrored", "noise"],
)
def test_images_that_do_not_are_refused(record, wrong):
    verdict = check(record, {t: wrong(t) for t in range(4)})
    assert verdict.reason is Reason.COLOUR_DISAGREES
    assert verdict.measured["rank_correlation"] < 0.6


def test_blank_images_are_refused_and_a_single_one_is_not(record):
    black = np.zeros((60, 80, 3), np.uint8)
    verdict = check(record, dict.fromkeys(range(4), black))
    assert (verdict.reason, verdict.measured["frames"]) == (Reason.COLOUR_BLANK, 4)
    assert check(record, {**IMAGES, 3: black}).keep


def test_a_wall_of_one_colour_tells_nothing(record):
    plain = {t: (100 + image * 0.1).astype(np.uint8) for t, image in IMAGES.items()}  # varies by 3 grey levels
    verdict = check(record, plain)
    assert verdict.keep
    assert verdict.measured.get("colour_steps", 0) == 0
