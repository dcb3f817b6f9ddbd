"""`wsm select --materialise`: the chosen clips as a release of their own, one unit a shard."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field

from pipelines.artifacts.layout import release_folder
from pipelines.running.stage import Finished, Outcome, Settled, Stage, StageContext, Unit
from wsm_data.access.derived.materialise import copy_shard, finish_selection, lay_out_selection
from wsm_data.access.release import Release, open_release
from wsm_data.files.digest import digest_json, sha256_bytes
from wsm_data.files.stores import open_store
from wsm_data.files.typed_toml import INPUT
from wsm_data.shards.manifest import ShardInfo
from wsm_data.shards.names import INDEX_NAME, INVENTORY_NAME, MANIFEST_NAME, QUARANTINE_NAME
from wsm_data.shards.selection import Selection, read_selection, selection_file


@dataclass(frozen=True, kw_only=True)
class MaterialiseConfig:
    """Settings of `wsm select --materialise`.

    Attributes:
        release: folder or URL of the release.
        selection: name of a selection of the release, or path of a selection file.
        shard_mib: shards are filled up to this size, MiB.
    """

    release: str = field(metadata=INPUT)
    selection: str = field(metadata=INPUT)
    shard_mib: int = 512


def _open(config: MaterialiseConfig) -> tuple[Release, Selection]:
    release = open_release(config.release)
    return release, read_selection(release.store, config.selection, release.digest, release.index)


def _list_units(config: MaterialiseConfig) -> Sequence[Unit]:
    release, selection = _open(config)
    layouts = lay_out_selection(release, selection, config.shard_mib << 20)
    return [
        Unit(
            id=layout.name,
            inputs={"parent": release.digest, "clips": digest_json([one.key for one in layout.clips])},
            payload=layout,
        )
        for layout in layouts
    ]


def _process(batch: Sequence[Unit], config: MaterialiseConfig, context: StageContext) -> Iterator[Outcome]:
    release, folder = open_release(config.release), release_folder(context.out)
    for unit in batch:
        path = folder / unit.payload.name
        shard = copy_shard(path, unit.payload, release)
        facts = {"clips": shard.clips, "bytes": shard.bytes, "shard": asdict(shard)}
        yield Outcome(unit=unit.id, digest=shard.sha256, outputs=(str(path.relative_to(context.out)),), facts=facts)


def _finish(config: MaterialiseConfig, context: StageContext, settled: Settled) -> Finished:
    """Write index, inventory and manifest once every shard stands."""
    if settled.pending:
        return Finished()
    release, selection = _open(config)
    layouts = lay_out_selection(release, selection, config.shard_mib << 20)
    finish_selection(
        release_folder(context.out),
        release,
        selection,
        layouts=layouts,
        shards=[ShardInfo(**settled.outcomes[layout.name].facts["shard"]) for layout in layouts],
        fingerprints=_selection_digest(config),
    )
    folder = release_folder(context.out).relative_to(context.out)
    written = (INDEX_NAME, INVENTORY_NAME, QUARANTINE_NAME, MANIFEST_NAME)
    return Finished(outputs=tuple(str(folder / name) for name in written))


def _selection_digest(config: MaterialiseConfig) -> dict[str, str]:
    """Digest of the selection file, under the name that the manifest gives it."""
    return {"selection": sha256_bytes(selection_file(open_store(config.release), config.selection)[1])}


STAGE = Stage(
    name="materialise",
    version=1,
    config_type=MaterialiseConfig,
    list_units=_list_units,
    process=_process,
    finish=_finish,
    finish_inputs=_selection_digest,
)
