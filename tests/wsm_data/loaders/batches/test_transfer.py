from dataclasses import replace

import numpy as np
import pytest
import torch

from wsm_data.errors import ConfigError
from wsm_data.loaders.batches.batch import BatchBlock, layout_of
from wsm_data.loaders.batches.standardise import standardisations
from wsm_data.loaders.batches.transfer import device_of, hand_over, on_device, open_transfer
from wsm_data.loaders.config import ReadConfig

CPU = torch.device("cpu")
needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")


@pytest.fixture
def block() -> BatchBlock:
    """Three rows of four latents, as they are stored."""
    layout = layout_of(3, 4, 2, (48, 6, 10), torch.float16)
    memory = torch.zeros(layout.size_bytes, dtype=torch.uint8)
    known = {"spans": (), "refs": np.arange(2), "keys": ("a", "b"), "epoch": 1, "step": 2}
    block = BatchBlock(memory=memory, layout=layout, **known)
    generator = torch.Generator().manual_seed(0)
    for name in ("rgb", "depth", "poses"):
        tensor = block.tensors[name]
        tensor.copy_(torch.randn(tensor.shape, generator=generator))
    block.tensors["sequence_id"].fill_(0)
    block.tensors["sequence_id"][2, 3:] = -1
    for name in ("rgb", "depth", "poses"):
        block.tensors[name][2, 3:] = 0
    return block


@pytest.mark.parametrize("device", ["abacus", "mps", "cuda:x"])
def test_only_the_processor_and_cuda_devices_are_delivered_to(device):
    with pytest.raises(ConfigError, match="device must be 'cpu' or a CUDA device, found"):
        device_of(ReadConfig(device=device))


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU here")
def test_a_gpu_that_is_not_there_is_refused(released):
    with pytest.raises(ConfigError, match="device = 'cuda' needs CUDA, and torch finds none; set device to 'cpu'"):
        open_transfer(ReadConfig(device="cuda"), released.release.manifest)


def test_on_the_processor_a_batch_is_its_block(released, block):
    batch = open_transfer(ReadConfig(), released.release.manifest)(block)
    assert batch.rgb.untyped_storage().data_ptr() == block.memory.untyped_storage().data_ptr()
    assert (batch.keys, batch.epoch, batch.step) == (("a", "b"), 1, 2)
    assert hand_over(batch) is batch


@pytest.mark.parametrize("dtype", [torch.float32, torch.bfloat16, torch.float16], ids=str)
def test_a_device_standardises_what_is_stored_and_leaves_padding_zero(released, block, dtype):
    moments = standardisations(released.release.manifest)
    batch = on_device(block, CPU, dtype, moments)
    stored = block.batch()
    for name in ("rgb", "depth"):
        expected = moments[name].whole(getattr(stored, name), dtype)
        expected[2, 3:] = 0
        assert torch.equal(getattr(batch, name), expected)
        assert getattr(batch, name).dtype is dtype
    assert torch.equal(batch.poses, stored.poses)


def test_without_moments_only_the_dtype_changes_on_a_device(block):
    batch = on_device(block, CPU, torch.float32, {})
    assert torch.equal(batch.rgb, block.batch().rgb.float())


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
