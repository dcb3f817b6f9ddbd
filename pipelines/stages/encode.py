"""`wsm encode`: trajectories into clips, one sequential pass over every archive and folder."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from pipelines.artifacts.codec_servers import codec_servers
from pipelines.artifacts.episode_table import read_episodes
from pipelines.artifacts.layout import clips_folder, codec_path, map_path, records_path
from pipelines.artifacts.source import IndexedSource, conventions_digest, indexed_source
from pipelines.running.stage import Finished, Outcome, Settled, Stage, StageContext, Unit, refused
from pipelines.running.upstream import done_outcomes, quarantine_of, require_stage, vouched_by_ledger
from wsm_data.checks.gate import require_kept
from wsm_data.clips.build import ClipVideos, Provenance, build_clip, measure_quality
from wsm_data.clips.config import ClipConfig
from wsm_data.clips.episode_gate import check_episode
from wsm_data.clips.path_on_floor import lay_path
from wsm_data.clips.scene_view import SceneView, view_scene
from wsm_data.codecs.base import ClipCodec, VideoCodec
from wsm_data.codecs.clip_video import VideoMemory
from wsm_data.codecs.registry import CodecConfig, describe_codec, make_codec
from wsm_data.codecs.served import ServedCodec
from wsm_data.errors import ConfigError, DataError
from wsm_data.files.atomic import write_text
from wsm_data.files.digest import sha256_bytes
from wsm_data.files.json_values import from_json, to_json
from wsm_data.files.typed_toml import INPUT, SELECTION
from wsm_data.maps.scene_map import SceneMap, floor_levels, load_scene_map
from wsm_data.readers.record_table import read_records
from wsm_data.readers.source import Container
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.verdict import Refusal
from wsm_data.shards.fragment import SIDECAR_SUFFIX, Fragment, build_fragment, write_fragment

CodecT = TypeVar("CodecT", bound=ClipCodec)


@dataclass(frozen=True, kw_only=True)
class EncodeConfig:
    """Settings of `wsm encode`.

    Attributes:
        index: folder of `wsm index`.
        map: folder of `wsm map`.
        clip: what a clip holds.
        codec: which codec encodes.
        quality_share: share of the clips, chosen by a hash of their ids, that are decoded again, when they are encoded,
            to measure the codec. Not a setting of the bytes of a clip.
    """

    index: Path = field(metadata=INPUT)
    map: Path = field(metadata=INPUT)
    clip: ClipConfig = field(default_factory=ClipConfig)
    codec: CodecConfig = field(default_factory=CodecConfig)
    quality_share: float = field(default=0.05, metadata=SELECTION)

    def __post_init__(self) -> None:
        if not 0 <= self.quality_share <= 1:
            raise ValueError(f"quality_share must lie in [0, 1], found {self.quality_share}")


@dataclass(frozen=True, kw_only=True)
class _SceneInput:
    """What the worker of one container needs beside the container; it pickles."""

    container: Container
    indexed: Outcome
    mapped: Outcome

    @property
    def map_from(self) -> str:
        """What the map was made of."""
        return str(self.mapped.facts["map_from"])


@dataclass(frozen=True, kw_only=True)
class _Prepared:
    """A trajectory that waits for the codec."""

    unit: Unit
    record: EpisodeRecord
    view: SceneView
    videos: ClipVideos


def _list_units(config: EncodeConfig) -> Sequence[Unit]:
    require_stage(config.map, "map")
    source = indexed_source(config.index)
    codec = describe_codec(config.codec).digest
    conventions = conventions_digest(source.dataset)
    containers = done_outcomes(config.index)
    maps = done_outcomes(config.map)
    refused_maps = {refusal.unit: refusal for refusal in quarantine_of(config.map)}
    units = []
    scenes: dict[str, _SceneInput] = {}
    for row in read_episodes(config.index):
        without = refused_maps.get(row.container)
        if without is not None:
            scene: _SceneInput | Refusal = without
            map_digest = f"refused {without.reason}"
        elif row.container in maps:
            indexed, mapped = containers[row.container], maps[row.container]
            if row.container not in scenes:
                container = from_json(Container, indexed.facts["container"])
                scenes[row.container] = _SceneInput(container=container, indexed=indexed, mapped=mapped)
            scene = scenes[row.container]
            map_digest = level_digest(mapped.facts, row.floor_z_m)
        else:
            continue  # its map is pending, and so is the trajectory
        inputs = {
            "trajectory": row.record_digest,
            "map": map_digest,
            "codec": codec,
            "dataset": conventions,
        }
        units.append(Unit(id=row.id.text, source=row.container, inputs=inputs, batch=row.container, payload=scene))
    return units


def level_digest(map_facts: Mapping[str, Any], floor_z_m: float) -> str:
    """Digest of the map level a trajectory lies on: a trajectory on another floor changes nothing here."""
    levels = dict(map_facts["levels"])
    return str(levels[floor_levels([floor_z_m])[0]])


def _process(batch: Sequence[Unit], config: EncodeConfig, context: StageContext) -> Iterator[Outcome]:
    scene = batch[0].payload
    if isinstance(scene, Refusal):
        for unit in batch:
            message = f"the scene of {unit.id} has no map: {scene.message}"
            yield refused(unit, DataError(scene.reason, message, scene.details))
        return
    source = indexed_source(config.index)
    codec = _codec(config.codec, batch[0].inputs["codec"], context.server)
    map_file = map_path(config.map, scene.container.id)
    scene_map = load_scene_map(vouched_by_ledger(config.map, scene.mapped, map_file))
    waiting: list[_Prepared] = []
    for prepared in _prepare(batch, scene, source, scene_map, config):
        if isinstance(prepared, Outcome):
            yield prepared
            continue
        waiting.append(prepared)
        if len(waiting) == config.codec.batch_clips:
            yield from _encode(waiting, scene, source, codec, config, context.out)
            waiting = []
    yield from _encode(waiting, scene, source, codec, config, context.out)


def _codec(config: CodecConfig, digest: str, server: str) -> ClipCodec:
    return _served_codec(config, digest, server) if server else _loaded_codec(config, digest)


@lru_cache(maxsize=1)
def _loaded_codec(config: CodecConfig, digest: str) -> VideoCodec:
    """The codec of the units, loaded once in a process; the digest tells when files in its folder were replaced."""
    return _of_the_digest(make_codec(config), config, digest)


@lru_cache(maxsize=1)
def _served_codec(config: CodecConfig, digest: str, address: str) -> ServedCodec:
    """The codec that others hold for this process; asked once whether it is that of the units."""
    return _of_the_digest(ServedCodec(address), config, digest)


def _of_the_digest(codec: CodecT, config: CodecConfig, digest: str) -> CodecT:
    if codec.describe().digest != digest:
        raise ConfigError(f"the weights in {config.weights} were changed while the stage ran; run `wsm encode` again")
    return codec


@lru_cache(maxsize=1)
def _video_memory() -> VideoMemory:
    """Memory for the videos of a process, which works on one clip after the other."""
    return VideoMemory()


def _prepare(
    batch: Sequence[Unit], scene: _SceneInput, source: IndexedSource, scene_map: SceneMap, config: EncodeConfig
) -> Iterator[_Prepared | Outcome]:
    """Read the trajectories of one container in one pass, on the map and as videos; the unusable come as outcomes."""
    units = {unit.id: unit for unit in batch}
    table = vouched_by_ledger(config.index, scene.indexed, records_path(config.index, scene.container.id))
    records = [one for one in read_records(table) if one.id.text in units]
    # One clip at a time is encoded before the next is read; several at a time need memory each.
    memory = _video_memory() if config.codec.batch_clips == 1 else None
    for record, frames in source.reader.iter_frames(source.root, scene.container, source.dataset, records):
        unit = units[record.id.text]
        try:
            laid = lay_path(record, scene_map, source.dataset, config.clip)
            verdicts, videos = check_episode(record, frames, scene_map, laid, source.dataset, config.clip, memory)
            require_kept(*verdicts.values())
            view = view_scene(record, laid, source.dataset, config.clip)
            yield _Prepared(unit=unit, record=record, view=view, videos=videos)
        except DataError as error:
            yield refused(unit, error)


def _encode(
    waiting: Sequence[_Prepared],
    scene: _SceneInput,
    source: IndexedSource,
    codec: ClipCodec,
    config: EncodeConfig,
    out: Path,
) -> Iterator[Outcome]:
    latents = iter(codec.encode_many([video for one in waiting for video in one.videos.all]))
    info = codec.describe()
    for one in waiting:
        own = [next(latents) for _ in one.videos.all]
        provenance = Provenance(
            dataset=source.dataset,
            map_digest=one.unit.inputs["map"],
            map_from=scene.map_from,
            codec=info.name,
            codec_digest=info.digest,
        )
        clip = build_clip(one.record, one.view, one.videos, own, provenance, config.clip)
        try:
            fragment = build_fragment(clip)
        except DataError as error:  # a name that cannot be stored is no fault of the others in the batch
            yield refused(one.unit, error)
            continue
        yield _written(one, fragment, _quality(one, own, codec, config), out)


def _written(one: _Prepared, fragment: Fragment, quality: dict[str, object] | None, out: Path) -> Outcome:
    path = write_fragment(clips_folder(out), fragment)
    facts: dict[str, object] = {
        "frames": one.record.frame_count,
        "bytes": fragment.info.size_bytes,
        "source_digest": one.record.content_digest,
        "quality": quality,
    }
    return Outcome(
        unit=one.unit.id,
        digest=fragment.info.digest,
        outputs=tuple(str(each.relative_to(out)) for each in (path, path.with_suffix(SIDECAR_SUFFIX))),
        facts=facts,
    )


def _quality(
    one: _Prepared, latents: Sequence[Float32Array], codec: ClipCodec, config: EncodeConfig
) -> dict[str, object] | None:
    rank = int(sha256_bytes(one.unit.id.encode())[:8], 16) / 16**8
    if rank >= config.quality_share:
        return None
    return to_json(measure_quality(one.videos, latents, codec, config.clip, one.record.frame_count))


def _finish(config: EncodeConfig, context: StageContext, settled: Settled) -> Finished:
    """Write what the codec says of itself beside the clips, for the release."""
    del settled
    _video_memory.cache_clear()  # the stages that follow in this process need it for other things
    write_text(codec_path(context.out), json.dumps(to_json(describe_codec(config.codec)), indent=2) + "\n")
    return Finished(outputs=(str(codec_path(context.out).relative_to(context.out)),))


def _serve(config: EncodeConfig, gpus: int) -> AbstractContextManager[str]:
    return codec_servers(config.codec, gpus)


STAGE = Stage(
    name="encode",
    version=5,
    config_type=EncodeConfig,
    list_units=_list_units,
    process=_process,
    finish=_finish,
    serve=_serve,
)
