"""Patches: the order of values on the way in and out."""

import torch

from wsm_model.layers.patches import cut_patches, join_patches


def test_patches_are_cut_as_the_kernel_of_a_convolution_sees_them():
    torch.manual_seed(0)
    latents, kernel = torch.randn(3, 5, 4, 6), torch.randn(7, 5, 2, 2)
    wanted = torch.nn.functional.conv2d(latents, kernel, stride=2).flatten(2).transpose(1, 2)
    torch.testing.assert_close(cut_patches(latents, 2) @ kernel.flatten(1).T, wanted)


def test_the_head_gives_row_column_channel():
    vectors = torch.arange(2 * 3 * 4 * 5).reshape(6, 20).float()  # 2 x 3 patches of 2 x 2 cells and 5 channels
    latents = join_patches(vectors, 2, rows=2)
    assert latents.shape == (5, 4, 6)
    for patch in range(6):
        for row in range(2):
            for column in range(2):
                for channel in range(5):
                    place = latents[channel, 2 * (patch // 3) + row, 2 * (patch % 3) + column]
                    assert place == vectors[patch, (row * 2 + column) * 5 + channel]


def test_joining_undoes_cutting_once_the_values_are_put_in_the_other_order():
    torch.manual_seed(0)
    latents = torch.randn(2, 3, 5, 4, 6)
    swapped = cut_patches(latents, 2).unflatten(-1, (5, 4)).transpose(-1, -2).flatten(-2)
    assert torch.equal(join_patches(swapped, 2, rows=2), latents)
