"""From batches of the query loader to the queries that are rolled out."""

import numpy as np

from wsm_data.loaders.batches.query_batch import QueryBatch
from wsm_data.schema.identity import EpisodeId
from wsm_model.posttraining.rollout import Query


def queries_of(batch: QueryBatch) -> list[Query]:
    """The queries of this rank, each by itself."""
    history = batch.history
    found = []
    for number, (key, span) in enumerate(zip(history.keys, history.spans, strict=True)):
        place = slice(span.start, span.end)
        poses = history.poses[span.row, place].reshape(-1, history.poses.shape[-1])
        found.append(
            Query(
                key=key,
                scene=EpisodeId.parse(key).physical_scene,
                replan_latent=int(batch.replan_latent[number]),
                rgb=history.rgb[span.row, place].float(),
                goal_camera0_m=history.goal_camera0_m[number].float(),
                T_world_camera=batch.T_world_camera[number].numpy(),
                true_m=poses[:, :3].double().cpu().numpy(),
                expert_distance_m=batch.expert_distance_m[number].numpy().astype(np.float64),
                reward_map=batch.map_of(number),
            )
        )
    return found
