"""`wsm score`: how hard every clip of a release is, one number for each thing that may make it so."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa

from pipelines.artifacts.release_files import content_digest, copy_into_release, warn_if_not_writable
from pipelines.running.stage import Finished, Outcome, Settled, Stage, StageContext, Unit
from wsm_data.access.release import Release, open_release, read_manifest
from wsm_data.codecs.base import VideoCodec
from wsm_data.codecs.dct import DctCodec
from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.rollouts import ROLLOUT_SCORES, read_rollouts, rollout_scores
from wsm_data.curation.score_clip import CLIP_SCORES, ClipScores, score_clip
from wsm_data.curation.scores_table import ScoreTable, read_paths, read_scores, write_scores
from wsm_data.errors import IntegrityError
from wsm_data.files.digest import digest_json, sha256_file
from wsm_data.files.stores import open_store
from wsm_data.files.typed_toml import INPUT, SELECTION
from wsm_data.shards.manifest import release_digest
from wsm_data.shards.names import SCORES_NAME
from wsm_data.shards.scores_statement import SCORES_VERSION

_PARTS = "parts"


@dataclass(frozen=True, kw_only=True)
class ScoreConfig:
    """Settings of `wsm score`.

    Attributes:
        release: folder or URL of the release.
        rollouts: path or URL of a table of rollouts on this release, for the scores of models; empty for none.
        depth_samples: latents of a clip whose depth is decoded, for the share of saturated depth; 0: none is. Depth of
            a codec other than `dct` is not decoded.
        install: whether the scores are copied into the release, where `wsm select` looks for them; where nothing can be
            written there, they stay in the folder of the stage alone, which is said before the work.
    """

    release: str = field(metadata=INPUT)
    rollouts: str = field(default="", metadata=INPUT)
    depth_samples: int = 3
    install: bool = field(default=True, metadata=SELECTION)

    def __post_init__(self) -> None:
        if self.depth_samples < 0:
            raise ValueError(f"depth_samples must not be negative, found {self.depth_samples}")


def _list_units(config: ScoreConfig) -> Sequence[Unit]:
    """One unit a shard: its clips, and all that the scores of a clip depend on beside it."""
    if config.install:
        warn_if_not_writable(config.release, SCORES_NAME, "name the scores to `wsm select` with --set scores=PATH")
    manifest = read_manifest(open_store(config.release))
    shared = {
        "codec": manifest.codec.digest,
        "rgb_std": digest_json(list(manifest.rgb_statistics.std)),
        "scores": digest_json([SCORES_VERSION, *(asdict(one) for one in CLIP_SCORES)]),
    }
    return [Unit(id=shard.name, inputs={"shard": shard.sha256, **shared}) for shard in manifest.shards]


def _process(batch: Sequence[Unit], config: ScoreConfig, context: StageContext) -> Iterator[Outcome]:
    release = open_release(config.release)
    rgb_std = np.array(release.manifest.rgb_statistics.std, np.float64)
    codec = _codec_of_single_latents(release.manifest.codec.digest)
    for unit in batch:
        keys, found = [], []
        for row in release.index.rows_of_shard(unit.id):
            keys.append(row.key)
            found.append(score_clip(release.read_row(row), rgb_std, codec, config.depth_samples))
        columns = {one.name: np.array([clip.values[one.name] for clip in found], np.float64) for one in CLIP_SCORES}
        table = ScoreTable(
            release_digest=unit.inputs["shard"], scorers=CLIP_SCORES, keys=pa.array(keys, pa.string()), columns=columns
        )
        path = _part_path(context.out, unit.id)
        write_scores(path, table, _outlines(found))
        outputs = (str(path.relative_to(context.out)),)
        yield Outcome(unit=unit.id, digest=sha256_file(path), outputs=outputs, facts={"clips": len(keys)})


def _outlines(clips: Sequence[ClipScores]) -> Outlines:
    return Outlines(
        xy_m=np.array([clip.outline_xy_m for clip in clips], np.float32),
        floor_z_m=np.array([clip.floor_z_m for clip in clips], np.float32),
    )


@lru_cache(maxsize=1)
def _codec_of_single_latents(digest: str) -> VideoCodec | None:
    """The codec of a release where it decodes a latent on its own, in milliseconds: `dct`, of this version."""
    codec = DctCodec()
    return codec if codec.describe().digest == digest else None


def _finish(config: ScoreConfig, context: StageContext, settled: Settled) -> Finished:
    """Put the parts together in the order of the index, add the scores of models, and install the table."""
    if settled.pending:
        return Finished()
    release = open_release(config.release)
    path = context.out / SCORES_NAME
    table, outlines = _merged(context.out, release)
    write_scores(path, _with_rollouts(table, config, release), outlines)
    return Finished(outputs=(SCORES_NAME, *_installed(path, config, context.out)))


def _merged(out: Path, release: Release) -> tuple[ScoreTable, Outlines]:
    """The scores and outlines of all clips, in the order of the index."""
    parts, outlines = [], []
    for shard in release.manifest.shards:
        path = _part_path(out, shard.name)
        parts.append(read_scores(path, release_digest=shard.sha256))
        outlines.append(read_paths(path, np.arange(len(parts[-1]))))
    keys = pa.concat_arrays([part.keys for part in parts])
    rows = release.index.rows_of(keys)
    if len(rows) != len(release.index) or (rows < 0).any():
        raise IntegrityError(
            f"{out} holds scores of {len(rows)} clips, the release {len(release.index)} others; run `wsm score` again"
        )
    order = np.argsort(rows)
    columns = {one.name: np.concatenate([part.columns[one.name] for part in parts])[order] for one in CLIP_SCORES}
    table = ScoreTable(
        release_digest=release_digest(release.manifest),
        scorers=CLIP_SCORES,
        keys=keys.take(pa.array(order)),
        columns=columns,
    )
    paths = Outlines(
        xy_m=np.concatenate([one.xy_m for one in outlines]),
        floor_z_m=np.concatenate([one.floor_z_m for one in outlines]),
    )
    return table, paths.take(order)


def _with_rollouts(table: ScoreTable, config: ScoreConfig, release: Release) -> ScoreTable:
    """The table with the scores of models beside its own, where rollouts are given."""
    if not config.rollouts:
        return table
    rollouts = read_rollouts(config.rollouts, table.release_digest, release.index)
    columns = {**table.columns, **rollout_scores(rollouts, pa.chunked_array([table.keys]))}
    return replace(table, scorers=(*table.scorers, *ROLLOUT_SCORES), columns=columns)


def _installed(path: Path, config: ScoreConfig, out: Path) -> tuple[str, ...]:
    """Copy the scores into a local release; returns the name of the copy, relative to the folder of the stage."""
    if not config.install:
        return ()
    copy = copy_into_release(path, config.release, SCORES_NAME)
    return (os.path.relpath(copy, out),) if copy else ()


def _finish_inputs(config: ScoreConfig) -> Mapping[str, str]:
    """What only the finished table depends on: which release it is, and the rollouts."""
    manifest = read_manifest(open_store(config.release))
    inputs = {"release": release_digest(manifest), "install": str(config.install)}
    if not config.rollouts:
        return inputs
    missing = f"there are no rollouts at {config.rollouts}; evaluate a policy on this release first"
    return {**inputs, "rollouts": content_digest(config.rollouts, missing)}


def _part_path(out: Path, shard: str) -> Path:
    """Scores of one shard's clips: a table of scores that names the shard's digest in place of a release's."""
    return out / _PARTS / f"{Path(shard).stem}.parquet"


STAGE = Stage(
    name="score",
    version=2,
    config_type=ScoreConfig,
    list_units=_list_units,
    process=_process,
    finish=_finish,
    finish_inputs=_finish_inputs,
)
