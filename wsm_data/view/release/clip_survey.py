"""One pass over the clips of a release, or over a sample of a large one: numbers, thumbnails, paths by scene."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from wsm_data.access.release import Release
from wsm_data.codecs.base import VideoCodec
from wsm_data.schema.clip import Clip
from wsm_data.view.clip.facts import ClipFacts, clip_facts
from wsm_data.view.clip.pictures import ClipPictures, decode_pictures, spread_frames
from wsm_data.view.clip.scene_overview import SceneOverview, ScenePath, scene_overview, scene_path


@dataclass(frozen=True, kw_only=True)
class SurveyConfig:
    """How much of a release is looked at.

    Attributes:
        max_clips: at most so many clips are read.
        thumbnails: clips that are shown with pictures.
        pictures: frames shown of each of them.
        scenes: scenes that are shown from above.
        paths: at most so many paths are drawn in a scene.
    """

    max_clips: int = 1000
    thumbnails: int = 6
    pictures: int = 3
    scenes: int = 6
    paths: int = 40


@dataclass(frozen=True, kw_only=True)
class ClipThumbnail:
    """A clip that is shown, and some of its frames decoded.

    Attributes:
        split: split of the clip.
        clip: the clip.
        pictures: the frames.
    """

    split: str
    clip: Clip
    pictures: ClipPictures


@dataclass(frozen=True, kw_only=True)
class ClipSurvey:
    """What was found in the clips that were read.

    Attributes:
        clips_in_release: clips of the release, read or not.
        facts: numbers of every clip that was read, by key.
        thumbnails: the clips that are shown.
        scenes: the scenes that are shown from above.
    """

    clips_in_release: int
    facts: tuple[ClipFacts, ...]
    thumbnails: tuple[ClipThumbnail, ...]
    scenes: tuple[SceneOverview, ...]


def survey_clips(release: Release, codec: VideoCodec, config: SurveyConfig | None = None) -> ClipSurvey:
    """Read clips of a release and measure them.

    Which clips are read depends on their keys alone: those whose sha256 is smallest. Equal releases give equal surveys.

    Raises:
        ConfigError: the release was encoded with another codec.
        IntegrityError: a clip that is read is damaged.
    """
    config = config or SurveyConfig()
    release.require_codec(codec.describe())
    ranked = ranked_keys(release.index.texts("key"))[: config.max_clips]
    rows = dict(zip(ranked, map(release.index.row_at, release.index.rows_of(ranked).tolist()), strict=True))
    scene_of = {key: row.physical_scene for key, row in rows.items()}
    shown = set(_one_per_scene(ranked, scene_of, config.thumbnails))
    paths = {scene: list[ScenePath]() for scene in _distinct(scene_of.values(), config.scenes)}
    facts, thumbnails = [], []
    for key in sorted(ranked):
        split, clip = rows[key].split, release.read_row(rows[key])
        facts.append(clip_facts(clip))
        if key in shown:
            pictures = decode_pictures(clip, codec, spread_frames(clip.meta.recorded_frames, config.pictures))
            thumbnails.append(ClipThumbnail(split=split, clip=clip, pictures=pictures))
        if len(paths.get(scene_of[key], range(config.paths))) < config.paths:
            paths[scene_of[key]].append(scene_path(clip, split))
    return ClipSurvey(
        clips_in_release=len(release.index),
        facts=tuple(facts),
        thumbnails=tuple(thumbnails),
        scenes=tuple(scene_overview(scene, found) for scene, found in sorted(paths.items())),
    )


def ranked_keys(keys: Iterable[str]) -> list[str]:
    """Keys in an order that looks random and never changes: by the sha256 of the key."""
    return sorted(keys, key=lambda key: hashlib.sha256(key.encode()).digest())


def _one_per_scene(ranked: Sequence[str], scene_of: dict[str, str], count: int) -> list[str]:
    """The first `count` keys, where a second key of a scene waits until every scene has had its first."""
    seen: dict[str, int] = {}
    rounds = []
    for place, key in enumerate(ranked):
        seen[scene_of[key]] = seen.get(scene_of[key], 0) + 1
        rounds.append((seen[scene_of[key]], place, key))
    return [key for _, _, key in sorted(rounds)[:count]]


def _distinct(values: Iterable[str], count: int) -> list[str]:
    return list(dict.fromkeys(values))[:count]
