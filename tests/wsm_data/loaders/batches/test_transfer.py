from dataclasses import replace

import numpy as np
import pytest
import torch

from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import PackedBatch, layout_of
from wsm_data.loaders.batches.standardise import standardisations
from wsm_data.loaders.batches.transfer import device_of, hand_over, on_device, open_transfer
from wsm_data.loaders.config import ReadConfig

CPU = torch.device("cpu")
needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")


@pytest.fixture
def packed() -> PackedBatch:
    """Three rows of four latents, as they are stored."""
    layout = layout_of(3, 4, 2, (48, 6, 10), torch.float16)
    block = torch.zeros(layout.size_bytes, dtype=torch.uint8)
    known = {"spans": (), "refs": np.arange(2), "keys": ("a", "b"), "epoch": 1, "step": 2}
    packed = PackedBatch(block=block, layout=layout, **known)
    generator = torch.Generator().manual_seed(0)
    for name in ("rgb", "depth", "poses"):
        tensor = packed.tensors()[name]
        tensor.copy_(torch.randn(tensor.shape, generator=generator))
    packed.tensors()["sequence_id"].fill_(0)
    packed.tensors()["sequence_id"][2, 3:] = -1
    for name in ("rgb", "depth", "poses"):
        packed.tensors()[name][2, 3:] = 0
    return packed


@pytest.mark.parametrize("device", ["abacus", "mps", "cuda:x"])
def test_only_the_processor_and_cuda_devices_are_delivered_to(device):
    with pytest.raises(ConfigError, match="device must be 'cpu' or a CUDA device, found"):
        device_of(ReadConfig(device=device))


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_gpu_that_is_not_there_is_refused(released):
    with pytest.raises(ConfigError, match="device = 'cuda' needs CUDA, and torch finds none; set device to 'cpu'"):
        open_transfer(ReadConfig(device="cuda"), released.release.manifest)


def test_on_the_processor_a_batch_is_its_block(released, packed):
    batch = open_transfer(ReadConfig(), released.release.manifest)(packed)
    assert batch.rgb.untyped_storage().data_ptr() == packed.block.untyped_storage().data_ptr()
    assert (batch.keys, batch.epoch, batch.step) == (("a", "b"), 1, 2)
    assert hand_over(batch) is batch


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16, torch.float16], ids=str)
def test_a_device_standardises_what_is_stored_and_leaves_padding_zero(released, packed, dtype):
    moments = standardisations(released.release.manifest)
    batch = on_device(packed, CPU, dtype, moments)
    stored = packed.unpacked()
    for name in ("rgb", "depth"):
        expected = moments[name].whole(getattr(stored, name), dtype)
        expected[2, 3:] = 0
        assert torch.equal(getattr(batch, name), expected)
        assert getattr(batch, name).dtype is dtype
    assert torch.equal(batch.poses, stored.poses)


def test_without_moments_only_the_dtype_changes_on_a_device(packed):
    batch = on_device(packed, CPU, torch.float32, {})
    assert torch.equal(batch.rgb, packed.unpacked().rgb.float())


@needs_gpu
@pytest.mark.parametrize("pinned", [False, True])
def test_a_gpu_gets_what_the_processor_gets(released, make_loader, pinned):
    """Bit for bit: the arithmetic is the same float32."""
    expected = list(make_loader())
    for own, other in zip(make_loader(device="cuda", pin_memory=pinned, threads=2), expected, strict=True):
        for name, value in vars(other).items():
            found = getattr(own, name)
            if isinstance(value, torch.Tensor):
                assert found.is_cuda
                assert torch.equal(found.cpu(), value), name
            else:
                assert found == value


@needs_gpu
def test_batches_on_a_gpu_are_not_overwritten(released, make_loader):
    expected = [batch.rgb.clone() for batch in make_loader()]
    kept = list(make_loader(device="cuda", pin_memory=True, threads=2, prefetch_batches=4))
    assert all(torch.equal(batch.rgb.cpu(), rgb) for batch, rgb in zip(kept, expected, strict=True))
    assert replace(kept[0], epoch=9).epoch == 9
