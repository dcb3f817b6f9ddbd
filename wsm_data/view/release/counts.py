"""What a release holds, counted over its index."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wsm_data.access.release import Release
from wsm_data.shards.index.table import IndexTable
from wsm_data.shards.names import TRAIN_SPLIT


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
    splits = sorted(release.manifest.clips_by_split, key=lambda split: (split != TRAIN_SPLIT, split))
    return ReleaseCounts(
        clips=len(release.index),
        frames_per_clip=frames_per_clip,
        padded_frames=int(release.index.numbers("padded_frames").sum()),
        bytes=sum(shard.bytes for shard in release.manifest.shards),
        splits=tuple(splits),
        groups=_groups(release.index, frames_per_clip),
        scenes=_scenes(release.index, frames_per_clip),
    )


@dataclass(frozen=True, kw_only=True)
class _Tally:
    """How often a combination of texts occurs."""

    texts: tuple[str, ...]
    clips: int
    frames: int


def _tallies(index: IndexTable, names: Sequence[str], frames_per_clip: np.ndarray) -> list[_Tally]:
    """Clips and frames of each combination of some text columns, sorted by their texts.

    Counted with numpy: pyarrow's `group_by` imports pandas, wherever it is installed.
    """
    if not len(index):
        return []
    columns = [index.codes(name) for name in names]
    sizes = [len(values) for _, values in columns]
    found, rows = np.unique(np.ravel_multi_index([codes for codes, _ in columns], sizes), return_inverse=True)
    clips, frames = np.bincount(rows), np.bincount(rows, weights=frames_per_clip)
    places = zip(*np.unravel_index(found, sizes), strict=True)
    texts = [tuple(values[place] for (_, values), place in zip(columns, one, strict=True)) for one in places]
    return sorted(
        (_Tally(texts=one, clips=int(clips[row]), frames=int(frames[row])) for row, one in enumerate(texts)),
        key=lambda tally: tally.texts,
    )


def _groups(index: IndexTable, frames_per_clip: np.ndarray) -> tuple[GroupCount, ...]:
    scenes = Counter(tally.texts[0] for tally in _tallies(index, ("group", "scene"), frames_per_clip))
    by_split = _tallies(index, ("group", "split", "camera"), frames_per_clip)
    return tuple(
        GroupCount(
            group=group,
            camera=next(tally.texts[2] for tally in by_split if tally.texts[0] == group),
            clips_by_split={tally.texts[1]: tally.clips for tally in by_split if tally.texts[0] == group},
            scenes=scenes[group],
            frames=sum(tally.frames for tally in by_split if tally.texts[0] == group),
        )
        for group in sorted(scenes)
    )


def _scenes(index: IndexTable, frames_per_clip: np.ndarray) -> SceneCount:
    tallies = _tallies(index, ("physical_scene", "split"), frames_per_clip)
    trained = {tally.texts[0] for tally in tallies if tally.texts[1] == TRAIN_SPLIT}
    held_out = {tally.texts[0] for tally in tallies if tally.texts[1] != TRAIN_SPLIT}
    shared = trained & held_out
    outside = [tally for tally in tallies if tally.texts[1] != TRAIN_SPLIT and tally.texts[0] in shared]
    return SceneCount(
        total=len(trained | held_out),
        by_split=dict(sorted(Counter(tally.texts[1] for tally in tallies).items())),
        held_out=len(held_out),
        shared=tuple(sorted(shared)),
        shared_clips=sum(tally.clips for tally in outside),
    )
