"""Latents of an analytic room, changed in known ways, against what its images give."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from box_room import DATASET, along_x, frames_of, record_of

from wsm_data.clips.build import Provenance, build_clip, read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.latent_audit import TOLERANCE, AuditedClip, audit_latents
from wsm_data.clips.scene_view import SceneView
from wsm_data.codecs.clip_video import pad_frames
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.images import rgb_pixels
from wsm_data.errors import Reason
from wsm_data.schema.occupancy import OccupancyGrid

DRIVE = along_x(frames=13)
RECORD, FRAMES = record_of(DRIVE), frames_of(DRIVE)
CONFIG = ClipConfig(width=32, height=32)
CODEC = DctCodec()
VIDEOS = read_videos(RECORD, FRAMES, DATASET, CONFIG)


def clip_of(rgb, depth=VIDEOS.depth):
    grid = OccupancyGrid(cells=np.zeros((4, 4), np.uint8), origin_cell=(0, 0), resolution_m=0.05)
    view = SceneView(
        occupancy=grid, geodesic_m=np.zeros((4, 4), np.float32), distance_m=np.linspace(1, 0, 13), freed_cells=0
    )
    provenance = Provenance(dataset=DATASET, map_digest="map", map_from="cloud", codec="dct", codec_digest="digest")
    return build_clip(RECORD, view, VIDEOS, (CODEC.encode(rgb), CODEC.encode(depth)), provenance, CONFIG)


def audit(clip, record=RECORD):
    return audit_latents(AuditedClip(clip=clip, record=record, frames=FRAMES, dataset=DATASET, codec=CODEC))


def test_latents_of_the_source_differ_by_the_rounding_to_float16_alone():
    """Rounding errs evenly within a step of 2^-11 to 2^-10 of a value: 1.4e-4 to 2.8e-4 in all (step / sqrt(12))."""
    verdict = audit(clip_of(VIDEOS.rgb))
    assert verdict.keep
    assert 1.4e-4 < verdict.measured["rgb_difference"] < 2.8e-4 < TOLERANCE["float32"]


@pytest.mark.parametrize("frames", [1, 5])
def test_another_start_of_the_clip_is_named(frames):
    rgb = pad_frames(np.ascontiguousarray(VIDEOS.rgb[frames:]), len(VIDEOS.rgb))
    verdict = audit(clip_of(rgb))
    assert verdict.reason is Reason.LATENT_START_CHANGED
    assert f"starts {frames} frames later" in verdict.message


def test_another_resize_is_named():
    images = [cv2.resize(rgb_pixels(one, ""), (32, 32), interpolation=cv2.INTER_LINEAR) for one in FRAMES.rgb]
    rgb = pad_frames(np.stack(images).astype(np.float32) / np.float32(127.5) - 1, len(VIDEOS.rgb))
    verdict = audit(clip_of(rgb))
    assert verdict.reason is Reason.LATENT_RESIZE_CHANGED
    assert "bilinear" in verdict.message


def test_exchanged_colours_are_named():
    verdict = audit(clip_of(np.ascontiguousarray(VIDEOS.rgb[..., ::-1])))
    assert verdict.reason is Reason.LATENT_CHANNELS_CHANGED


def test_latents_that_were_rounded_to_bfloat16_are_named():
    """The eight bits of bfloat16, half to even: by cutting the sixteen lower bits after adding half of their step."""
    clip = clip_of(VIDEOS.rgb)
    bits = CODEC.encode(VIDEOS.rgb).view(np.uint32)
    rounded = ((bits + 0x7FFF + ((bits >> 16) & 1)) & 0xFFFF0000).astype(np.uint32).view(np.float32)
    assert audit(replace(clip, rgb_latent=rounded.astype(np.float16))).reason is Reason.LATENT_DTYPE_CHANGED


def test_latents_that_nothing_explains_are_another_codecs():
    clip = clip_of(VIDEOS.rgb)
    turned = np.ascontiguousarray(clip.depth_latent[:, ::-1])
    verdict = audit(replace(clip, depth_latent=turned))
    assert verdict.reason is Reason.LATENT_CODEC_CHANGED
    assert verdict.measured["rgb_difference"] < TOLERANCE["float32"] < verdict.measured["depth_difference"]


def test_a_source_that_was_changed_is_named_before_anything_is_encoded():
    assert audit(clip_of(VIDEOS.rgb), replace(RECORD, content_digest="other")).reason is Reason.LATENT_SOURCE_CHANGED
