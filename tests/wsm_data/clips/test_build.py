"""One trajectory of an analytic room as a clip."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from box_room import DATASET, INTRINSICS, along_x, encoded, frames_of, raw_depth, record_of

from wsm_data.clips.build import QUALITY_STRIDE, Provenance, build_clip, measure_quality, read_videos
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.scene_view import SceneView
from wsm_data.codecs.dct import DctCodec
from wsm_data.codecs.depth import depth_m_from_latent_video
from wsm_data.codecs.quality import DEPTH_EDGES_M
from wsm_data.errors import DataError, Reason
from wsm_data.geometry.camera import project
from wsm_data.geometry.transform import invert, transform_points, transforms_from_vectors
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.schema.sequence import TEMPORAL_RATIO

DRIVE = along_x()
FRAMES = frames_of(DRIVE)
FRAME_COUNT = len(FRAMES.rgb)
CONFIG = ClipConfig(width=64, height=32)
PROVENANCE = Provenance(dataset=DATASET, map_digest="map", map_from="cloud", codec="dct", codec_digest="digest")
FLOAT32 = 1e-6  # rounding of metres and quaternions below ten


@pytest.fixture(scope="module")
def videos():
    return read_videos(record_of(DRIVE), FRAMES, DATASET, CONFIG)


@pytest.fixture(scope="module")
def latents(videos):
    return tuple(DctCodec().encode_many([videos.rgb, videos.depth]))


@pytest.fixture
def view():
    """Any map will do: that it is passed on unchanged is what counts here."""
    rng = np.random.default_rng(0)
    cells = rng.choice(np.array([0, 1, 255], np.uint8), (8, 5))
    geodesic_m = np.where(cells == 0, rng.uniform(0, 70, cells.shape), np.inf).astype(np.float32)
    return SceneView(
        occupancy=OccupancyGrid(cells=cells, origin_cell=(-3, 7), resolution_m=0.05),
        geodesic_m=geodesic_m,
        distance_m=np.linspace(1.5, 0.0, len(DRIVE.xy_m)),
        freed_cells=11,
    )


@pytest.fixture
def build(view, videos, latents):
    def make(record=None, provenance=PROVENANCE):
        return build_clip(record or record_of(DRIVE), view, videos, latents, provenance, CONFIG)

    return make


def damaged(**changes):
    """The files of the drive with some replaced, such as `depth_3`."""
    files = {"rgb": list(FRAMES.rgb), "depth": list(FRAMES.depth)}
    for name, data in changes.items():
        kind, number = name.split("_")
        files[kind][int(number)] = data
    return replace(FRAMES, rgb=tuple(files["rgb"]), depth=tuple(files["depth"]))


# videos


@pytest.mark.parametrize(("frames", "still", "length"), [(7, 16, 25), (9, 16, 25), (10, 0, 13), (5, 0, 5), (6, 4, 13)])
def test_videos_are_padded_to_whole_latents_and_the_still_frames_with_the_last_frame(frames, still, length):
    drive = along_x(frames=frames, step_m=0.1)
    config = replace(CONFIG, still_frames=still)
    found = read_videos(record_of(drive), frames_of(drive), DATASET, config)
    for video in (found.rgb, found.depth, found.depth_valid):
        assert len(video) == length
        assert (video[frames:] == video[frames - 1]).all()
        assert video.shape[1:3] == (32, 64)


def test_the_depth_video_holds_the_depth_of_the_room(videos):
    """Each pixel of the encoded image takes a stored one, so depths are exact but for their rounding in float32."""
    rows = [int((row + 0.5) * 48 / 32) for row in range(32)]  # in which the centres of 32 rows lie
    wanted = np.clip(raw_depth(DRIVE)[:, rows] * 1e-4, 0.2, 5.0)
    found = depth_m_from_latent_video(videos.depth, CONFIG.depth_range)[: len(wanted)]
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_a_frame_without_any_measurement_is_refused_and_repeats_at_the_end_are_not_counted():
    blind = encoded(".png", np.zeros((48, 64), np.uint16))
    with pytest.raises(DataError) as caught:
        read_videos(record_of(DRIVE), damaged(depth_6=blind), DATASET, CONFIG)
    error = caught.value
    assert error.reason is Reason.DEPTH_NO_MEASUREMENT
    assert (error.details["frame"], error.details["frames"]) == (6, 1)
    assert error.details["mean_measured_share"] == pytest.approx(6 / 7)
    assert "1 of 7 hold none" in error.message


@pytest.mark.parametrize(
    ("change", "reason", "where"),
    [
        ({"rgb_3": b"no jpeg"}, Reason.FRAME_UNDECODABLE, "colour frame 3"),
        ({"depth_5": b"no png"}, Reason.FRAME_UNDECODABLE, "depth frame 5"),
        ({"depth_2": encoded(".png", np.ones((48, 64), np.uint8))}, Reason.DEPTH_NOT_16_BIT, "depth frame 2"),
    ],
)
def test_a_frame_that_cannot_be_used_refuses_the_trajectory_and_is_named(change, reason, where):
    with pytest.raises(DataError, match=f"box_d435i/hall/000000, {where}") as caught:
        read_videos(record_of(DRIVE), damaged(**change), DATASET, CONFIG)
    assert caught.value.reason is reason


# poses and the goal


def test_the_first_pose_is_the_identity_and_the_last_is_repeated(build):
    poses = build().poses
    assert poses[0].tolist() == [0, 0, 0, 1, 0, 0, 0]
    assert (poses[7:] == poses[6]).all()
    assert not (poses[6] == poses[5]).all()


def test_poses_after_the_first_camera_are_the_cameras_in_the_world(build):
    clip = build()
    T_world_camera = clip.meta.T_world_camera0_matrix @ transforms_from_vectors(clip.poses.astype(np.float64))
    np.testing.assert_allclose(T_world_camera[:7], DRIVE.T_world_camera, atol=FLOAT32)


def test_the_goal_in_the_first_camera_is_the_goal_in_the_world(build):
    meta = build().meta
    goal_world_m = transform_points(meta.T_world_camera0_matrix, np.array([meta.goal_camera0_m]))[0]
    np.testing.assert_allclose(goal_world_m, meta.goal_world_m, atol=1e-12)
    assert meta.goal_world_m == (*DRIVE.xy_m[-1], 0.5)


def test_the_goal_is_where_the_last_pose_says(build):
    clip = build()
    np.testing.assert_allclose(clip.poses[-1, :3], clip.meta.goal_camera0_m, atol=FLOAT32)


def test_ahead_of_the_first_camera_is_z_and_a_goal_ahead_lies_there(build):
    """The camera looks along x and is pitched 10 degrees down; the goal is 1.5 m ahead at its own height."""
    x, y, z = build().meta.goal_camera0_m
    np.testing.assert_allclose([x, y, z], [0, -1.5 * np.sin(np.deg2rad(10)), 1.5 * np.cos(np.deg2rad(10))], atol=1e-12)


# intrinsics


def test_a_point_is_seen_at_the_same_place_of_the_encoded_image_as_of_the_stored_one(build):
    points = transform_points(invert(DRIVE.T_world_camera[0]), np.array([[3.0, 1.0, 0.3], [2.5, 0.7, 0.9]]))
    stored, _ = project(points, INTRINSICS)
    encoded_size = build().meta.intrinsics
    found, _ = project(points, encoded_size)
    assert (encoded_size.width, encoded_size.height) == (64, 32)
    share = (stored + 0.5) / (64, 48)  # of the image's sides, from its corner
    np.testing.assert_allclose((found + 0.5) / (64, 32), share, atol=1e-12)


# the map and the distance


def test_the_expert_distance_ends_at_zero_and_stays_there(build, view):
    distance = build().expert_distance
    np.testing.assert_array_equal(distance[:7], view.distance_m.astype(np.float32))
    assert (distance[6:] == 0).all()
    assert len(distance) == 25


def test_the_map_is_the_crop_and_its_field_in_millimetres(build, view):
    clip = build()
    np.testing.assert_array_equal(clip.occupancy, view.occupancy.cells)
    reachable = np.isfinite(view.geodesic_m)
    assert (clip.geodesic_mm[~reachable] == 65535).all()
    np.testing.assert_allclose(
        clip.geodesic_mm[reachable], np.minimum(view.geodesic_m[reachable] * 1e3, 65534), atol=0.5
    )
    meta = clip.meta
    assert (meta.map_origin_cell, meta.map_resolution_m, meta.freed_cells) == ((-3, 7), 0.05, 11)


# what is stored


def test_latents_are_the_codecs_rounded_to_float16(build, latents):
    clip = build()
    for stored, computed in zip((clip.rgb_latent, clip.depth_latent), latents, strict=True):
        np.testing.assert_array_equal(stored, computed.astype(np.float16))
        assert len(stored) == 7


def test_the_share_of_measured_depth_counts_repeated_frames_like_the_last(view, latents):
    raw = raw_depth(DRIVE)
    raw[6, :, :32] = 0  # half of the last frame, which is repeated
    files = damaged(depth_6=encoded(".png", raw[6]))
    videos = read_videos(record_of(DRIVE), files, DATASET, CONFIG)
    share = build_clip(record_of(DRIVE), view, videos, latents, PROVENANCE, CONFIG).depth_valid
    assert (share[0] == 255).all()
    assert (share[2, :, :2] == round(255 / 4)).all()  # latent 2 covers frames 5 to 8; of 5 alone the left is measured
    assert (share[3:, :, :2] == 0).all()
    assert (share[:, :, 2:] == 255).all()


def test_frames_and_their_padding_are_told(build):
    assert (build().meta.frames, build().meta.padded_frames) == (25, 18)


@pytest.mark.parametrize(
    ("notes", "map_from", "told"),
    [
        ((), "cloud", ()),
        (("episode.length_mismatch",), "cloud", ("episode.length_mismatch",)),
        ((), "depth", ("cloud.missing",)),
        (("episode.length_mismatch",), "depth", ("episode.length_mismatch", "cloud.missing")),
    ],
)
def test_what_was_accepted_but_is_worth_knowing_is_noted(build, notes, map_from, told):
    clip = build(replace(record_of(DRIVE), notes=notes), replace(PROVENANCE, map_from=map_from))
    assert clip.meta.notes == told
    assert clip.meta.map_from == map_from


def test_where_a_clip_comes_from_is_told(build):
    record = record_of(DRIVE)
    meta = build().meta
    assert (meta.id, meta.key, meta.dataset) == (record.id, record.id.key, "box_rooms")
    assert (meta.source_digest, meta.map_digest) == ("content", "map")
    assert (meta.codec, meta.codec_digest, meta.depth_range) == ("dct", "digest", CONFIG.depth_range)
    assert (meta.goal_radius_m, meta.robot_radius_m) == (CONFIG.goal_radius_m, DATASET.robot.radius_m)
    assert (meta.camera_height_m, meta.camera_pitch_rad) == (record.camera_height_m, record.camera_pitch_rad)


# codec quality


@dataclass
class Codec:
    """Decodes to given videos, and remembers what it was asked to decode."""

    videos: list[np.ndarray]
    asked: list[np.ndarray] = field(default_factory=list)

    def decode(self, latents):
        self.asked.append(latents)
        return self.videos[len(self.asked) - 1]


def test_quality_is_that_of_the_stored_float16_latents(videos, latents):
    codec = Codec([videos.rgb, videos.depth])
    measure_quality(videos, latents, codec, CONFIG, FRAME_COUNT)
    for asked, computed in zip(codec.asked, latents, strict=True):
        assert asked.dtype == np.float32
        np.testing.assert_array_equal(asked, computed.astype(np.float16))
        assert not np.array_equal(asked, computed)


def test_quality_is_told_of_all_places_in_a_block_and_of_no_repeated_frame(videos, latents):
    """Frame t is wrong by t / 100, so that the squared error tells which frames were compared."""
    length = len(videos.rgb)
    wrong = videos.rgb + np.arange(length, dtype=np.float32)[:, None, None, None] / 100
    quality = measure_quality(videos, latents, Codec([wrong, videos.depth]), CONFIG, 9)
    assert quality.frames == 2  # frames 0 and 7
    assert quality.squared_error_sum / videos.rgb[0].size == pytest.approx(0.07**2, rel=1e-3)
    assert {t % TEMPORAL_RATIO for t in range(0, 28, QUALITY_STRIDE)} == {0, 1, 2, 3}


def test_a_codec_without_loss_has_no_error(videos, latents):
    quality = measure_quality(videos, latents, Codec([videos.rgb, videos.depth]), CONFIG, FRAME_COUNT)
    assert (quality.clips, quality.squared_error_sum, quality.psnr_db) == (1, 0.0, np.inf)
    assert quality.values == videos.rgb[:FRAME_COUNT:QUALITY_STRIDE].size
    assert sum(quality.depth.error_sum_m) == 0.0


def test_errors_are_counted_where_depth_was_measured_and_by_its_true_range(latents):
    raw = raw_depth(DRIVE)
    raw[:, :, 32:] = 0
    files = replace(FRAMES, depth=tuple(encoded(".png", image) for image in raw))
    videos = read_videos(record_of(DRIVE), files, DATASET, CONFIG)
    farther = np.clip(videos.depth + 0.1, -1, 1)
    quality = measure_quality(videos, latents, Codec([np.clip(videos.rgb + 0.2, -1, 1), farther]), CONFIG, FRAME_COUNT)
    shown = videos.depth_valid[:FRAME_COUNT:QUALITY_STRIDE]
    assert sum(quality.depth.counts) == shown.sum() == shown.size // 2
    true_m = depth_m_from_latent_video(videos.depth, CONFIG.depth_range)[:FRAME_COUNT:QUALITY_STRIDE][shown]
    wrong_m = depth_m_from_latent_video(farther, CONFIG.depth_range)[:FRAME_COUNT:QUALITY_STRIDE][shown]
    assert quality.depth.edges_m == DEPTH_EDGES_M
    for low, high, count, total in zip(
        DEPTH_EDGES_M, DEPTH_EDGES_M[1:], quality.depth.counts, quality.depth.error_sum_m, strict=False
    ):
        inside = (true_m >= low) & ((true_m < high) | (high == DEPTH_EDGES_M[-1]))
        assert count == inside.sum()
        assert total == pytest.approx(np.abs(wrong_m - true_m)[inside].sum(dtype=np.float64), rel=1e-5)
    assert quality.psnr_db == pytest.approx(20 * np.log10(2 / 0.2), abs=0.1)


def test_what_the_codec_loses_is_between_nothing_and_everything(videos, latents):
    quality = measure_quality(videos, latents, DctCodec(), CONFIG, FRAME_COUNT)
    frames = videos.rgb[:FRAME_COUNT:QUALITY_STRIDE]
    spread_db = 10 * np.log10(4 / np.var(frames))  # what a codec would have that knows the mean colour and no more
    assert spread_db + 6 < quality.psnr_db < np.inf
