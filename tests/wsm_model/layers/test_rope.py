"""Rotary positions against diffusers' tables and as rotations."""

import pytest
import torch
from diffusers.models.transformers.transformer_wan import WanRotaryPosEmbed

from wsm_model.config import Expert
from wsm_model.layers.rope import axis_widths, frame_positions, rotary_angles, rotary_tables, rotate, token_offsets

THETA = 10000.0


def test_a_head_of_128_is_split_as_in_wan():
    assert axis_widths(128) == (44, 42, 42)


@pytest.mark.parametrize("head_width", [12, 32, 128])
def test_tables_equal_those_of_diffusers_at_whole_positions(config, head_width):
    theirs = WanRotaryPosEmbed(head_width, (1, 2, 2), 64)
    cos, sin = theirs(torch.zeros(1, 1, 3, config.latent_height, config.latent_width))
    offsets = token_offsets(config, Expert.GENERATION)
    positions = frame_positions(torch.arange(3)[None], offsets)[0].flatten(0, 1)
    ours = rotary_tables(positions, head_width, THETA)
    assert torch.equal(ours[0], cos[0, :, 0, 0::2])  # both from float64; diffusers stores each value twice
    assert torch.equal(ours[1], sin[0, :, 0, 1::2])


def test_products_of_queries_and_keys_depend_on_the_difference_of_positions_alone():
    torch.manual_seed(0)
    query, key = torch.randn(2, 1, 1, 12)
    first = torch.tensor([[3.0, 1.0, 2.0]]), torch.tensor([[5.25, -1.0, 0.0]])
    moved = tuple(place + torch.tensor([7.5, -3.0, 4.0]) for place in first)
    products = [
        (rotate(query, rotary_tables(a, 12, THETA)) * rotate(key, rotary_tables(b, 12, THETA))).sum()
        for a, b in (first, moved)
    ]
    torch.testing.assert_close(*products)


def test_turning_keeps_lengths_and_position_zero_turns_nothing():
    torch.manual_seed(0)
    x = torch.randn(5, 2, 12)
    places = torch.randn(5, 3, dtype=torch.float64) * 20
    torch.testing.assert_close(rotate(x, rotary_tables(places, 12, THETA)).norm(dim=-1), x.norm(dim=-1))
    assert torch.equal(rotate(x, rotary_tables(torch.zeros(5, 3), 12, THETA)), x)


def test_angles_fall_geometrically_with_a_denominator_of_each_axis():
    angles = rotary_angles(torch.tensor([[1.0, 1.0, 1.0]], dtype=torch.float64), 12, THETA)[0]
    wanted = [THETA ** (-2 * i / width) for width in axis_widths(12) for i in range(width // 2)]
    assert angles.tolist() == pytest.approx(wanted)


def test_pose_slots_stand_outside_of_the_image_and_end_at_their_latent(config):
    """Slot m of latent j: t = j - (M - m) / M, h = w = -1 (specification, section 4)."""
    places = frame_positions(torch.tensor([[2]]), token_offsets(config, Expert.POSE))[0, 0]
    assert places[:, 0].tolist() == [1.25, 1.5, 1.75, 2.0]
    assert (places[:, 1:] == -1).all()
