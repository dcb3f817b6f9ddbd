import numpy as np

from wsm_data.clips.lerobot.rows import ACTION, DTYPES, GOAL, INTRINSICS, NAMES, STATE, WORLD_POSE, clip_rows
from wsm_data.geometry.transform import transforms_from_vectors


def test_every_feature_has_its_numbers_and_dtype_in_every_recorded_frame(clip):
    rows = clip_rows(clip)
    assert set(rows) == set(NAMES) == set(DTYPES)
    for name, values in rows.items():
        assert values.shape == (clip.meta.recorded_frames, len(NAMES[name]))
        assert values.dtype == DTYPES[name]


def test_the_state_is_what_the_clip_stores(clip):
    assert np.array_equal(clip_rows(clip)[STATE], clip.poses[: clip.meta.recorded_frames])


def test_actions_applied_one_after_the_other_drive_the_whole_way(clip):
    rows = clip_rows(clip)
    T = np.eye(4)
    for step, action in enumerate(rows[ACTION][:-1]):
        T = T @ transforms_from_vectors(action)
        assert np.abs(T - transforms_from_vectors(rows[STATE][step + 1])).max() < 1e-5  # float32, summed up
    assert rows[ACTION][-1].tolist() == [0, 0, 0, 1, 0, 0, 0]


def test_goal_and_pose_of_any_frame_give_the_goal_in_the_world(clip):
    rows = clip_rows(clip)
    for pose, goal in zip(rows[WORLD_POSE], rows[GOAL], strict=True):
        T_world_camera = pose.reshape(4, 4)
        assert np.abs(T_world_camera[:3, :3] @ goal + T_world_camera[:3, 3] - clip.meta.goal_world_m).max() < 1e-5


def test_the_camera_is_exact(clip):
    K = clip.intrinsics
    assert (clip_rows(clip)[INTRINSICS] == [K.fx, K.fy, K.cx, K.cy]).all()
