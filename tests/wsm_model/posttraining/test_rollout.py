import numpy as np
import torch

from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Session, SessionConfig
from wsm_model.posttraining.reward import RewardConfig, score_dreams
from wsm_model.posttraining.rollout import generator_of, roll_out


def test_a_query_is_rolled_out_through_the_models_own_estimates(make_model, make_query):
    query, session = make_query(), Session(make_model().eval(), SessionConfig(chunk_size=2))
    noise = torch.randn(3, 2, *query.rgb.shape[1:], generator=generator_of(query, 0, 0))
    group = roll_out(session, query, noise, flow_schedule(2, 5.0), RewardConfig())
    assert group.rgb.shape == noise.shape
    assert group.paths_xy_m.shape == (3, 8, 2)
    assert group.episode.observed == 3
    assert group.start_xy_m.tolist() == [0.0, 0.0]
    again = score_dreams(query.reward_map, group.start_xy_m, group.paths_xy_m, query.expert_distance_m, RewardConfig())
    np.testing.assert_array_equal(again.reward, group.scored.reward)
    assert group.ate_rmse_sim3_m >= 0


def test_what_is_drawn_for_a_query_depends_on_it_and_the_epoch_alone(make_query):
    draws = [
        torch.randn(4, generator=generator_of(query, seed, epoch)).tolist()
        for query, seed, epoch in (
            (make_query(0), 0, 0),
            (make_query(0), 0, 0),
            (make_query(1), 0, 0),
            (make_query(0), 1, 0),
        )
    ]
    assert draws[0] == draws[1]
    assert draws[0] != draws[2]
    assert draws[0] != draws[3]
