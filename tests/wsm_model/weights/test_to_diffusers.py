"""The exported RGB expert in diffusers beside ours, and what comes back."""

from dataclasses import replace

import pytest
import torch
from diffusers import WanTransformer3DModel

from wsm_data.errors import ConfigError
from wsm_model.config import Expert, ExpertConfig
from wsm_model.layers.goal import fourier_features
from wsm_model.model import WorldSlamModel
from wsm_model.mot.attention import attend_densely
from wsm_model.weights.from_wan import load_wan_weights
from wsm_model.weights.to_diffusers import write_diffusers

FRAMES, ROWS, COLUMNS = 3, 4, 6
TOKENS = FRAMES * (ROWS // 2) * (COLUMNS // 2)


@pytest.fixture
def model(config):
    torch.manual_seed(1)
    shape = replace(config, heads=4, head_width=12, generation=ExpertConfig(width=48, feed_forward_width=64))
    model = WorldSlamModel(shape).eval()
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
    return model


def test_diffusers_computes_what_the_rgb_expert_computes_with_the_goal_as_its_text(model, tmp_path):
    write_diffusers(tmp_path, model)
    wan = WanTransformer3DModel.from_pretrained(tmp_path).eval()
    latents, goal = torch.randn(2, 6, FRAMES, ROWS, COLUMNS), torch.randn(2, 3)
    times = torch.randint(0, 1000, (2, TOKENS)).float()
    config = model.config
    with torch.no_grad():
        text = fourier_features(goal, config.goal_frequencies, config.goal_base_rad_per_m)[:, None]
        found = wan(latents, times, text, return_dict=False)[0]
        context = model.goal(goal)[:, None, None].expand(-1, FRAMES, 1, -1)
        expert = model.expert(Expert.GENERATION)
        numbers = torch.arange(FRAMES).expand(2, FRAMES)
        stream = expert.stream(latents.transpose(1, 2).unsqueeze(1), times.view(2, 1, FRAMES, -1), numbers, 0)
        everything = torch.ones(2, TOKENS, TOKENS, dtype=torch.bool)
        done = model.run({Expert.GENERATION: stream}, lambda _, tokens: attend_densely(tokens, everything), context)
        wanted = expert.read(done[Expert.GENERATION]).transpose(1, 2)
    torch.testing.assert_close(found, wanted, rtol=1e-5, atol=1e-5 * float(wanted.abs().max()))


def test_what_is_written_is_read_back_to_the_bit(model, tmp_path):
    write_diffusers(tmp_path, model)
    other = WorldSlamModel(model.config)
    load_wan_weights(other, tmp_path)
    own = dict(model.named_parameters())
    for name, parameter in other.named_parameters():
        if ".generation." in name:
            assert torch.equal(parameter, own[name]), name


def test_an_expert_that_is_no_transformer_of_wan_is_refused(config, tmp_path):
    with pytest.raises(ConfigError, match="as wide as its attention"):
        write_diffusers(tmp_path, WorldSlamModel(config))
