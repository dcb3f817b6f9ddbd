"""`wsm pack`: clips into shards, shards into a release."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path

from pipelines.artifacts.inventory import account_of
from pipelines.artifacts.layout import clips_folder, codec_path, release_folder
from pipelines.artifacts.source import indexed_source
from pipelines.artifacts.split_table import read_split
from pipelines.running.stage import Finished, Outcome, Reads, Settled, Stage, StageContext, Unit
from pipelines.running.upstream import (
    UpstreamMissing,
    done_outcomes,
    pending_units,
    quarantine_of,
    require_stage,
    vouched_by_ledger,
    vouched_by_record,
)
from wsm_data.clips.config import ClipConfig
from wsm_data.codecs.quality import CodecQuality
from wsm_data.files.digest import digest_json
from wsm_data.files.json_values import from_json, load_json, to_json
from wsm_data.files.typed_toml import INPUT, SELECTION, build_config
from wsm_data.schema.codec import CodecInfo
from wsm_data.schema.identity import EpisodeId
from wsm_data.shards.assemble import ReleaseFacts, finish_release
from wsm_data.shards.fragment import FRAGMENT_SUFFIX, SIDECAR_SUFFIX, FragmentInfo, fragment_path, read_fragment_info
from wsm_data.shards.manifest import ShardInfo
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, MANIFEST_NAME, QUARANTINE_NAME
from wsm_data.shards.shard_layout import PlacedClip, ShardLayout, lay_out_shards
from wsm_data.shards.writer import write_shard

_SHOWN_REASONS = 3


@dataclass(frozen=True, kw_only=True)
class PackConfig:
    """Settings of `wsm pack`.

    Attributes:
        index: folder of `wsm index`.
        split: folder of `wsm split`.
        map: folder of `wsm map`.
        encode: folder of `wsm encode`.
        name: name of the release.
        shard_mib: shards are filled up to this size, MiB.
        seed: another seed, another order of the clips.
        partial: pack although trajectories are pending; the release says so. Not a setting of the bytes of a shard.
    """

    index: Path = field(metadata=INPUT)
    split: Path = field(metadata=INPUT)
    map: Path = field(metadata=INPUT)
    encode: Path = field(metadata=INPUT)
    name: str = "release"
    shard_mib: int = 512
    seed: int = 0
    partial: bool = field(default=False, metadata=SELECTION)

    def __post_init__(self) -> None:
        if self.shard_mib < 1:
            raise ValueError(f"shard_mib must be at least 1, found {self.shard_mib}")


@dataclass(frozen=True, kw_only=True)
class _Shard:
    """What the worker of a shard needs: its clips in their order, and what became of each by its key; it pickles.

    The ledger of `encode` has a line for every clip of the release, which no shard should have to read.
    """

    layout: ShardLayout
    clips: Mapping[str, Outcome]


def _list_units(config: PackConfig) -> Sequence[Unit]:
    for name in ("index", "split", "map", "encode"):
        require_stage(getattr(config, name), name)
    _require_complete(config)
    outcomes = _clips(config)
    splits = read_split(config.split)
    clips = [
        PlacedClip(key=EpisodeId.parse(name).key, split=splits[name], size_bytes=outcome.facts["bytes"])
        for name, outcome in outcomes.items()
    ]
    by_key = {EpisodeId.parse(name).key: outcome for name, outcome in outcomes.items()}
    layouts = lay_out_shards(clips, shard_bytes=config.shard_mib << 20, seed=config.seed)
    return [
        Unit(
            id=layout.name,
            inputs={"clips": digest_json([[one.key, by_key[one.key].digest] for one in layout.clips])},
            payload=_Shard(layout=layout, clips={one.key: by_key[one.key] for one in layout.clips}),
        )
        for layout in layouts
    ]


def _clips(config: PackConfig) -> Mapping[str, Outcome]:
    """Outcomes of the trajectories that became clips and still belong to the source, by id."""
    splits = read_split(config.split)
    clips = {name: outcome for name, outcome in done_outcomes(config.encode).items() if name in splits}
    if not clips:
        raise UpstreamMissing(f"{config.encode} holds no clip; {_why_no_clip(config)}")
    return clips


def _why_no_clip(config: PackConfig) -> str:
    """The most frequent refusals of the trajectories, with one message of each."""
    refusals = [refusal for folder in (config.index, config.encode) for refusal in quarantine_of(folder)]
    if not refusals:
        return "no trajectory was encoded, and none was refused: look at what `wsm index` found"
    counts = Counter(refusal.reason for refusal in refusals).most_common(_SHOWN_REASONS)
    examples = {refusal.reason: refusal.message for refusal in reversed(refusals)}
    return "refused were\n" + "\n".join(f"  {count} x {reason}, as: {examples[reason]}" for reason, count in counts)


def _pending(config: PackConfig) -> list[str]:
    return [unit for folder in (config.index, config.map, config.encode) for unit in pending_units(folder)]


def _require_complete(config: PackConfig) -> None:
    pending = _pending(config)
    if pending and not config.partial:
        raise UpstreamMissing(
            f"{len(pending)} units are pending, such as {pending[0]}; run `wsm index`, `wsm map` and `wsm encode` to "
            "their end, or pack what there is with --set partial=true"
        )


def _reads(config: PackConfig, units: Sequence[Unit]) -> Reads:
    """The clips of the shards; their sidecars make the index, whatever is packed."""
    clips = [outcome for unit in units for outcome in unit.payload.clips.values()]
    return {config.encode: {one.unit: tuple(out for out in one.outputs if _is_clip(out)) for one in clips}}


def _is_clip(output: str) -> bool:
    return output.endswith(FRAGMENT_SUFFIX)


def _process(batch: Sequence[Unit], config: PackConfig, context: StageContext) -> Iterator[Outcome]:
    release = release_folder(context.out)
    for unit in batch:
        packed: _Shard = unit.payload
        path = release / packed.layout.name
        shard = write_shard(path, packed.layout, partial(_fragment, config.encode, packed.clips))
        facts = {"clips": shard.clips, "bytes": shard.bytes, "shard": asdict(shard)}
        yield Outcome(unit=unit.id, digest=shard.sha256, outputs=(str(path.relative_to(context.out)),), facts=facts)


def _fragment(encode: Path, clips: Mapping[str, Outcome], key: str) -> Path:
    """The fragment of a clip, where it and its sidecar are as `encode` wrote them."""
    path = fragment_path(clips_folder(encode), key)
    for file in (path, path.with_suffix(SIDECAR_SUFFIX)):
        vouched_by_ledger(encode, clips[key], file)
    return path


def _sidecar(encode: Path, clips: Mapping[str, Outcome], key: str) -> FragmentInfo:
    """The sidecar of a clip, where it is as `encode` wrote it; its fragment is not read."""
    path = fragment_path(clips_folder(encode), key)
    vouched_by_ledger(encode, clips[key], path.with_suffix(SIDECAR_SUFFIX))
    return read_fragment_info(path)


def _finish(config: PackConfig, context: StageContext, settled: Settled) -> Finished:
    """Write index, inventory and manifest once every shard stands."""
    if settled.pending:
        return Finished()
    shards: list[_Shard] = [unit.payload for unit in _list_units(config)]
    layouts = [shard.layout for shard in shards]
    by_key = {key: outcome for shard in shards for key, outcome in shard.clips.items()}
    clips = {outcome.unit: outcome for outcome in by_key.values()}
    digests = {name: outcome.facts["source_digest"] for name, outcome in clips.items()}
    account = account_of(config.index, config.encode, read_split(config.split), digests)
    finish_release(
        release_folder(context.out),
        _facts(config, clips),
        layouts=layouts,
        shards=[ShardInfo(**settled.outcomes[layout.name].facts["shard"]) for layout in layouts],
        read_info=partial(_sidecar, config.encode, by_key),
        inventory=account.rows,
        refusals=account.quarantine,
    )
    written = (INDEX_NAME, INVENTORY_NAME, QUARANTINE_NAME, MANIFEST_NAME)
    release = release_folder(context.out).relative_to(context.out)
    return Finished(outputs=tuple(str(release / name) for name in written))


def _facts(config: PackConfig, clips: Mapping[str, Outcome]) -> ReleaseFacts:
    records = {name: require_stage(getattr(config, name), name) for name in ("index", "split", "map", "encode")}
    codec_file = vouched_by_record(config.encode, str(codec_path(config.encode).relative_to(config.encode)))
    clip = build_config(ClipConfig, records["encode"].settings["clip"])
    dataset = indexed_source(config.index).dataset
    return ReleaseFacts(
        name=config.name,
        codec=load_json(CodecInfo, codec_file, "what the codec says of itself", "run `wsm encode` again"),
        depth_range=clip.depth_range,
        encoded_width_px=clip.width,
        encoded_height_px=clip.height,
        fingerprints={name: record.fingerprint for name, record in records.items()},
        licences={dataset.name: f"{dataset.licence} ({dataset.homepage})" if dataset.homepage else dataset.licence},
        codec_quality=_quality(clips),
        partial=bool(_pending(config)),
    )


def _quality(clips: Mapping[str, Outcome]) -> dict[str, object]:
    """Merged quality of the clips on which it was measured when they were encoded; empty where none was."""
    measured = [outcome.facts["quality"] for _, outcome in sorted(clips.items()) if outcome.facts["quality"]]
    merged: CodecQuality | None = None
    for record in measured:
        quality = from_json(CodecQuality, record)
        merged = quality if merged is None else merged.merge(quality)
    return to_json(merged) if merged else {}


STAGE = Stage(
    name="pack",
    version=1,
    config_type=PackConfig,
    list_units=_list_units,
    process=_process,
    finish=_finish,
    reads=_reads,
)
