"""What a release holds, counted over its index."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from wsm_data.access.release import Release
from wsm_data.shards.index import IndexTable
from wsm_data.shards.names import TRAIN_SPLIT

_TEXT_COLUMNS = ("split", "group", "camera", "scene", "physical_scene")


@dataclass(frozen=True, kw_only=True)
class GroupCount:
    """What one data set group contributes.

    Attributes:
        group: name of the group.
        camera: name of its camera.
        clips_by_split: clips of each split.
        scenes: scenes.
        frames: raw frames, padding left out.
    """

    group: str
    camera: str
    clips_by_split: Mapping[str, int]
    scenes: int
    frames: int

    @property
    def clips(self) -> int:
        """Clips of all splits."""
        return sum(self.clips_by_split.values())


@dataclass(frozen=True, kw_only=True)
class SceneCount:
    """How the physical scenes are spread over the splits. A scene that two cameras filmed counts once.

    Attributes:
        total: physical scenes of the release.
        by_split: physical scenes of each split.
        held_out: physical scenes of the splits that are not trained on.
        shared: those of them that occur in training too, sorted.
        shared_clips: held-out clips in shared scenes.
    """

    total: int
    by_split: Mapping[str, int]
    held_out: int
    shared: tuple[str, ...]
    shared_clips: int


@dataclass(frozen=True, kw_only=True, eq=False)
class ReleaseCounts:
    """Counts over all clips of a release.

    Attributes:
        clips: clips.
        frames_per_clip: raw frames of each clip, padding left out; int64 [clips].
        padded_frames: repeated still frames of all clips.
        bytes: size of all shards.
        splits: names of the splits, training first.
        groups: what each group contributes, sorted by name.
        scenes: physical scenes.
    """

    clips: int
    frames_per_clip: np.ndarray
    padded_frames: int
    bytes: int
    splits: tuple[str, ...]
    groups: tuple[GroupCount, ...]
    scenes: SceneCount

    @property
    def frames(self) -> int:
        """Raw frames of all clips, padding left out."""
        return int(self.frames_per_clip.sum())

    @property
    def cameras(self) -> dict[str, int]:
        """Clips of each camera, sorted by name."""
        counted: Counter[str] = Counter()
        for group in self.groups:
            counted[group.camera] += group.clips
        return dict(sorted(counted.items()))


def count_release(release: Release) -> ReleaseCounts:
    """Count the clips of a release over its index; no shard is opened."""
    frames_per_clip = release.index.numbers("frames").astype(np.int64) - release.index.numbers("padded_frames")
    table = _text_columns(release.index).append_column("frames", pa.array(frames_per_clip))
    splits = sorted(release.manifest.clips_by_split, key=lambda split: (split != TRAIN_SPLIT, split))
    return ReleaseCounts(
        clips=len(release.index),
        frames_per_clip=frames_per_clip,
        padded_frames=int(release.index.numbers("padded_frames").sum()),
        bytes=sum(shard.bytes for shard in release.manifest.shards),
        splits=tuple(splits),
        groups=_groups(table),
        scenes=_scenes(table),
    )


def _text_columns(index: IndexTable) -> pa.Table:
    columns = index.columns(_TEXT_COLUMNS)
    return pa.table({name: columns[name].cast(pa.string()) for name in _TEXT_COLUMNS})


def _groups(table: pa.Table) -> tuple[GroupCount, ...]:
    grouped = table.group_by(["group", "camera", "split"]).aggregate([("frames", "count"), ("frames", "sum")])
    scenes = Counter(row["group"] for row in table.group_by(["group", "scene"]).aggregate([]).to_pylist())
    rows = sorted(grouped.to_pylist(), key=lambda row: (row["group"], row["split"]))
    return tuple(
        GroupCount(
            group=group,
            camera=next(row["camera"] for row in rows if row["group"] == group),
            clips_by_split={row["split"]: row["frames_count"] for row in rows if row["group"] == group},
            scenes=scenes[group],
            frames=sum(row["frames_sum"] for row in rows if row["group"] == group),
        )
        for group in sorted(scenes)
    )


def _scenes(table: pa.Table) -> SceneCount:
    rows = table.group_by(["physical_scene", "split"]).aggregate([("frames", "count")]).to_pylist()
    trained = {row["physical_scene"] for row in rows if row["split"] == TRAIN_SPLIT}
    held_out = {row["physical_scene"] for row in rows if row["split"] != TRAIN_SPLIT}
    shared = trained & held_out
    outside = [row for row in rows if row["split"] != TRAIN_SPLIT and row["physical_scene"] in shared]
    return SceneCount(
        total=len(trained | held_out),
        by_split=dict(sorted(Counter(row["split"] for row in rows).items())),
        held_out=len(held_out),
        shared=tuple(sorted(shared)),
        shared_clips=sum(row["frames_count"] for row in outside),
    )
