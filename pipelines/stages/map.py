"""`wsm map`: what a robot can and cannot drive over, for every scene and floor."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from pipelines.artifacts.layout import map_path, surface_path
from pipelines.artifacts.source import conventions_digest, indexed_source
from pipelines.running.stage import Outcome, Stage, StageContext, Unit, refused
from pipelines.running.upstream import done_outcomes, vouched_by_ledger
from wsm_data.errors import DataError, Reason
from wsm_data.files.digest import digest_json
from wsm_data.files.json_values import from_json
from wsm_data.files.typed_toml import INPUT
from wsm_data.maps.scene_map import build_scene_map, floor_levels, save_scene_map, scene_map_digest
from wsm_data.maps.voxels import load_voxels
from wsm_data.schema.verdict import Refusal


class WithoutCloud(StrEnum):
    """What becomes of a scene without a point cloud."""

    FUSE = "fuse"
    REFUSE = "refuse"


@dataclass(frozen=True, kw_only=True)
class MapConfig:
    """Settings of `wsm map`.

    Attributes:
        index: folder of `wsm index`.
        without_cloud: `fuse` the map from depth images and note it (cloud.missing), or `refuse` the scene. Where there
            is no depth either, the map is what the expert's footprint swept.
    """

    index: Path = field(metadata=INPUT)
    without_cloud: WithoutCloud = WithoutCloud.FUSE


def _list_units(config: MapConfig) -> Sequence[Unit]:
    conventions = conventions_digest(indexed_source(config.index).dataset)
    return [
        Unit(
            id=container,
            source=container,
            inputs={
                "surface": outcome.facts["surface"],
                "cloud_refusal": digest_json(outcome.facts["cloud_refusal"]),
                "floors": digest_json(_floors(outcome.facts)),
                "dataset": conventions,
            },
            payload=outcome,
        )
        for container, outcome in done_outcomes(config.index).items()
        if outcome.facts["episodes"]
    ]


def _process(batch: Sequence[Unit], config: MapConfig, context: StageContext) -> Iterator[Outcome]:
    for unit in batch:
        try:
            yield _map_scene(unit, config, context.out)
        except DataError as error:
            yield refused(unit, error)


def _map_scene(unit: Unit, config: MapConfig, out: Path) -> Outcome:
    facts = unit.payload.facts
    if facts["cloud_refusal"] is not None:
        refusal = from_json(Refusal, facts["cloud_refusal"])
        raise DataError(refusal.reason, refusal.message, refusal.details)
    voxels = load_voxels(vouched_by_ledger(config.index, unit.payload, surface_path(config.index, unit.id)))
    if voxels.origin != "cloud" and config.without_cloud is WithoutCloud.REFUSE:
        raise DataError(
            Reason.CLOUD_MISSING,
            f"{unit.id} has no point cloud; add meta/pointcloud.ply, or let the map be fused from depth images with "
            "without_cloud = fuse",
        )
    dataset = indexed_source(config.index).dataset
    scene_map = build_scene_map(voxels, _floors(facts), dataset.robot, dataset.max_camera_height_m)
    path = map_path(out, unit.id)
    path.parent.mkdir(parents=True, exist_ok=True)
    save_scene_map(path, scene_map)
    measured = {
        "floors": len(scene_map.levels),
        "map_from": voxels.origin,
        "levels": [[level.floor_z_m, scene_map_digest(scene_map, level.floor_z_m)] for level in scene_map.levels],
    }
    return Outcome(
        unit=unit.id, digest=scene_map_digest(scene_map), outputs=(str(path.relative_to(out)),), facts=measured
    )


def _floors(facts: Mapping[str, Any]) -> tuple[float, ...]:
    return floor_levels([row["floor_z_m"] for row in facts["episodes"]])


STAGE = Stage(name="map", version=3, config_type=MapConfig, list_units=_list_units, process=_process)
