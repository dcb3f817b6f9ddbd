import pytest
import torch

from wsm_model.config import Variant
from wsm_model.evaluation.streaming import DreamRequest, dream_bounds, stream_clip
from wsm_model.inference.session import SessionConfig

CONFIG = SessionConfig(chunk_size=2, cache_latents=16)


def test_every_latent_keeps_the_last_of_its_estimates(make_model, batch):
    model = make_model(latent_channels=48)
    found = stream_clip(model, batch.rgb[0], CONFIG)
    whole_chunk = stream_clip(model, batch.rgb[0, :3], CONFIG)
    assert torch.equal(found.depth[:3], whole_chunk.depth)
    assert (found.poses[..., 3:].norm(dim=-1) - 1).abs().max() < 1e-5
    assert found.dream is None


@pytest.mark.parametrize("variant", list(Variant))
def test_a_dream_on_the_way_is_that_of_the_latents_seen_and_leaves_no_trace(make_model, batch, variant):
    model = make_model(variant, latent_channels=48)
    noise = torch.randn(2, *batch.rgb.shape[2:], generator=torch.Generator().manual_seed(1))
    request = DreamRequest(after=3, goal_camera0_m=batch.goal_camera0_m[0], noise=noise, schedule=[1.0, 0.5, 0.0])
    whole, half = (
        stream_clip(model, batch.rgb[0, :end], CONFIG, issued_FM7=batch.poses[0, :end], request=request)
        for end in (5, 3)
    )
    assert whole.dream.first == 3
    assert torch.equal(whole.dream.rgb, half.dream.rgb)
    without = stream_clip(model, batch.rgb[0], CONFIG, issued_FM7=batch.poses[0])
    assert torch.equal(whole.poses, without.poses)


@pytest.mark.parametrize(
    ("length", "chunk", "bounds"), [(20, 4, (10, 14)), (5, 4, (1, 5)), (3, 4, (1, 3)), (1, 4, (1, 1))]
)
def test_a_dream_begins_in_the_middle_or_where_its_chunk_still_fits(length, chunk, bounds):
    assert dream_bounds(length, chunk) == bounds
