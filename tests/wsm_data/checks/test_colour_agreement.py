"""A camera moves sideways along a patterned wall 2 m away: every image is the one before, moved by whole pixels."""

import dataclasses

import cv2
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


def green(images):
    return np.stack([images[t][..., 1] for t in sorted(images)]).astype(np.float32) / np.float32(127.5) - 1


def check(record, images):
    return check_colour_agreement(record, green(images), DEPTH, STEPS, 0.6)


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


def test_images_of_another_size_than_depth_are_looked_at_where_they_show_the_same(record):
    """Twice as large, each pixel four times: the means of their areas are the pixels of the smaller ones."""
    large = {t: image.repeat(2, axis=0).repeat(2, axis=1) for t, image in IMAGES.items()}
    assert check(record, large).measured["rank_correlation"] > 0.99


@pytest.mark.parametrize("late", [-3, 2, 5])
def test_images_that_are_some_frames_late_are_named_where_others_fit_clearly_better(make_record, late):
    """The wall is wide waves, so that images a few frames off correlate well, and those of the right frame best."""
    frames, depth = 24, np.full((60, 80), 2.0, np.float32)
    x_m = 0.002 * np.arange(frames) ** 2.2
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 0, 3] = x_m
    record = dataclasses.replace(make_record(frames=frames), T_world_camera=poses, intrinsics=INTRINSICS)
    column = np.arange(80) / 50  # m on the wall, 2 m away at fx = 100
    seen = np.stack([np.sin(5 * (column + x)) + np.sin(9 * (column + x)) for x in x_m]) / 3
    video = np.repeat(seen[:, None], 60, axis=1).astype(np.float32)
    steps = [(t, t + 3) for t in range(0, frames - 3, 3)]
    depth_m = dict.fromkeys(range(frames), depth)
    assert check_colour_agreement(record, video, depth_m, steps, 0.6).keep
    wrong = video[np.clip(np.arange(frames) - late, 0, frames - 1)]
    verdict = check_colour_agreement(record, wrong, depth_m, steps, 0.0)
    assert verdict.reason is Reason.COLOUR_DISAGREES
    assert verdict.measured["fits"] == f"those of {abs(late)} frames {'later' if late > 0 else 'earlier'}"


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        (lambda video: video[:, :, ::-1], "mirrored"),
        (lambda video: video[::-1], "in reverse order"),
    ],
)
def test_images_that_were_turned_over_are_named(make_record, wrong, named):
    """A wall whose pattern is wide, so that neighbouring points are alike, seen along a way that gets faster."""
    frames, fine = 16, np.random.default_rng(1)
    shift = np.rint(0.2 * np.arange(frames) ** 1.8).astype(int)
    pattern = cv2.GaussianBlur(fine.normal(size=(60, 140)).astype(np.float32), (0, 0), 6)
    pattern *= 0.4 / pattern.std()
    video = np.stack([pattern[:, s : s + 80] for s in shift])
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 0, 3] = 0.02 * shift
    record = dataclasses.replace(make_record(frames=frames), T_world_camera=poses, intrinsics=INTRINSICS)
    steps, depth_m = [(t, t + 2) for t in range(0, 14, 2)], dict.fromkeys(range(frames), DEPTH[0])
    assert check_colour_agreement(record, video, depth_m, steps, 0.6).keep
    assert check_colour_agreement(record, wrong(video), depth_m, steps, 0.0).measured["fits"] == named
