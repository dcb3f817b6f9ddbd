"""Weights of Wan2.2's transformer: parity with diffusers in both layouts, and what is refused."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from diffusers import WanTransformer3DModel
from safetensors.torch import load_file, save_file

from wsm_data.errors import ConfigError
from wsm_model.config import Expert, ExpertConfig
from wsm_model.model import WorldSlamModel
from wsm_model.mot.attention import attend_densely
from wsm_model.weights.from_wan import load_wan_weights
from wsm_model.weights.interpolation import resize_tensor

FRAMES, ROWS, COLUMNS, TEXT_TOKENS = 3, 4, 6, 5
TOKENS = FRAMES * (ROWS // 2) * (COLUMNS // 2)

TO_ORIGINAL = {
    "condition_embedder.time_embedder.linear_1": "time_embedding.0",
    "condition_embedder.time_embedder.linear_2": "time_embedding.2",
    "condition_embedder.time_proj": "time_projection.1",
    "condition_embedder.text_embedder.linear_1": "text_embedding.0",
    "condition_embedder.text_embedder.linear_2": "text_embedding.2",
    "attn1.to_out.0": "self_attn.o",
    "attn2.to_out.0": "cross_attn.o",
    "attn1.to_": "self_attn.",
    "attn2.to_": "cross_attn.",
    "attn1.norm": "self_attn.norm",
    "attn2.norm": "cross_attn.norm",
    ".norm2.": ".norm3.",
    "ffn.net.0.proj": "ffn.0",
    "ffn.net.2": "ffn.2",
    "proj_out": "head.head",
}
"""The table of the specification, section 1, read from right to left."""


def original_name(name: str) -> str:
    """Name in the original checkpoint of a tensor of the diffusers layout."""
    if name == "scale_shift_table":
        return "head.modulation"
    if name.endswith(".scale_shift_table"):
        return name.replace("scale_shift_table", "modulation")
    for theirs, ours in TO_ORIGINAL.items():
        name = name.replace(theirs, ours)
    return name


@pytest.fixture(scope="module")
def wan():
    """The real class with small random weights: 4 heads of 12, two layers."""
    torch.manual_seed(0)
    model = WanTransformer3DModel(
        num_attention_heads=4,
        attention_head_dim=12,
        in_channels=6,
        out_channels=6,
        text_dim=10,
        freq_dim=32,
        ffn_dim=64,
        num_layers=2,
    )
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.add_(0.02 * torch.randn_like(parameter))
    return model.eval()


@pytest.fixture
def our_config(config):
    """The same shape for the generation expert."""
    return replace(config, heads=4, head_width=12, generation=ExpertConfig(width=48, feed_forward_width=64))


@pytest.fixture(params=["diffusers", "diffusers, sharded", "original"])
def folder(request, wan, tmp_path):
    """The weights on disk in each layout."""
    if request.param.startswith("diffusers"):
        wan.save_pretrained(tmp_path, max_shard_size="100KB" if "sharded" in request.param else "1GB")
    else:
        tensors = {original_name(name): tensor.contiguous() for name, tensor in wan.state_dict().items()}
        save_file(tensors, tmp_path / "diffusion_pytorch_model.safetensors")
    return tmp_path


def test_the_generation_expert_equals_diffusers_with_a_time_for_every_token(wan, our_config, folder):
    model = WorldSlamModel(replace(our_config, goal_tokens=TEXT_TOKENS))
    load_wan_weights(model, folder)
    latents, text = torch.randn(2, 6, FRAMES, ROWS, COLUMNS), torch.randn(2, TEXT_TOKENS, 10)
    times = torch.randint(0, 1000, (2, TOKENS)).float()
    with torch.no_grad():
        wanted = wan(latents, times, text, return_dict=False)[0]
        context = wan.condition_embedder.text_embedder(text)[:, None].expand(-1, FRAMES, -1, -1)
        expert = model.expert(Expert.GENERATION)
        clean = latents.transpose(1, 2).unsqueeze(1)
        numbers = torch.arange(FRAMES).expand(2, FRAMES)
        stream = expert.stream(clean, times.view(2, 1, FRAMES, -1), numbers, 0)
        everything = torch.ones(2, TOKENS, TOKENS, dtype=torch.bool)
        done = model.run({Expert.GENERATION: stream}, lambda _, tokens: attend_densely(tokens, everything), context)
        found = expert.read(done[Expert.GENERATION]).transpose(1, 2)
    # diffusers computes sinusoids in float32, the specification in float64: the rest is rounding.
    torch.testing.assert_close(found, wanted, rtol=1e-5, atol=1e-5 * float(wanted.abs().max()))


def test_every_tensor_is_copied_resized_or_named_as_new(our_config, folder):
    model = WorldSlamModel(our_config)
    report = load_wan_weights(model, folder)
    names = set(dict(model.named_parameters()))
    assert set(report.copied) | set(report.resized) | set(report.new) == names
    assert len(report.copied) + len(report.resized) + len(report.new) == len(names)
    new_parts = {".".join(name.split(".")[:3]) for name in report.new}
    assert all(part.startswith(("goal.", "experts.pose.embedding", "experts.pose.head")) for part in new_parts)
    of_text = [name for name in report.unused if "text_embed" in name]
    of_one_key = [name for name in report.unused if name not in of_text]  # two layers of q, k and three norms
    assert len(of_text) == 4
    assert len(of_one_key) == 2 * (2 + 2 + 1 + 1 + 2)
    assert all(re.search(r"(attn2|cross_attn)\.(to_)?(q|k|norm_q|norm_k)\.|norm[23]\.", name) for name in of_one_key)
    counts = f"{len(report.copied)} tensors copied, {len(report.resized)} resized, {len(report.new)} new"
    assert report.summary() == f"{counts}, 20 of the source not used"


def test_state_experts_hold_the_weights_interpolated_to_their_widths(wan, our_config, tmp_path):
    wan.save_pretrained(tmp_path)
    model = WorldSlamModel(our_config)
    load_wan_weights(model, tmp_path)
    source, ours = wan.state_dict(), dict(model.named_parameters())
    query = ours["layers.1.experts.depth.attention.to_q.weight"]
    torch.testing.assert_close(query, resize_tensor(source["blocks.1.attn1.to_q.weight"], (48, 32), 1))
    table = ours["layers.1.experts.pose.table"]
    torch.testing.assert_close(table, resize_tensor(source["blocks.1.scale_shift_table"][0], (6, 24), None))
    projection = ours["experts.depth.time.projection.bias"].view(6, 32)
    wanted = resize_tensor(source["condition_embedder.time_proj.bias"].view(6, 48), (6, 32), None)
    torch.testing.assert_close(projection, wanted)  # each of the six vectors by itself


def test_weights_of_another_width_are_refused_for_the_generation_expert(wan, config, tmp_path):
    wan.save_pretrained(tmp_path)
    with pytest.raises(ConfigError, match=r"takes Wan2\.2's weights as they are"):
        load_wan_weights(WorldSlamModel(config), tmp_path)


def test_a_folder_without_weights_is_refused(our_config, tmp_path):
    with pytest.raises(ConfigError, match=r"must hold diffusion_pytorch_model\.safetensors or"):
        load_wan_weights(WorldSlamModel(our_config), tmp_path)


def test_a_missing_tensor_is_named(wan, our_config, tmp_path):
    wan.save_pretrained(tmp_path)
    path = tmp_path / "diffusion_pytorch_model.safetensors"
    tensors = load_file(path)
    del tensors["blocks.0.ffn.net.2.bias"]
    save_file(tensors, path)
    with pytest.raises(ConfigError, match=r"there is none for layers.0.experts.generation.feed_forward.2.bias"):
        load_wan_weights(WorldSlamModel(our_config), tmp_path)


def test_a_cut_file_is_refused(wan, our_config, tmp_path):
    wan.save_pretrained(tmp_path)
    path = tmp_path / "diffusion_pytorch_model.safetensors"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ConfigError, match="must be a whole safetensors file"):
        load_wan_weights(WorldSlamModel(our_config), tmp_path)


def test_an_index_that_leads_out_of_its_folder_is_refused(our_config, tmp_path):
    index = {"weight_map": {"proj_out.weight": "../elsewhere.safetensors"}}
    (tmp_path / "diffusion_pytorch_model.safetensors.index.json").write_text(json.dumps(index))
    with pytest.raises(ConfigError, match="must name files of its own folder"):
        load_wan_weights(WorldSlamModel(our_config), Path(tmp_path))
