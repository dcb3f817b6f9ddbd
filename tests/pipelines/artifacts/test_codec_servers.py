"""Codecs in processes of their own, one a GPU: here on the CPU, with another count of devices."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from pipelines.artifacts import codec_servers as module
from pipelines.artifacts.codec_servers import codec_servers
from pipelines.running.engines.choice import EngineName
from pipelines.running.options import RunOptions, StageRequest
from wsm_data.codecs.registry import CodecConfig, make_codec
from wsm_data.codecs.served import ServedCodec
from wsm_data.errors import ConfigError, WsmError

torch = pytest.importorskip("torch")
diffusers = pytest.importorskip("diffusers")


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    """A VAE of the real structure, narrow and with random weights."""
    from wsm_data.codecs.wan import GEOMETRY

    torch.manual_seed(0)
    statistics = {"latents_mean": [0.0] * 48, "latents_std": [1.0] * 48}
    vae = diffusers.AutoencoderKLWan(**GEOMETRY, base_dim=8, decoder_base_dim=8, **statistics)
    folder = tmp_path_factory.mktemp("wan") / "vae"
    vae.save_pretrained(folder, safe_serialization=True)
    return CodecConfig(name="wan", weights=str(folder))


@pytest.fixture(autouse=True)
def two_devices(monkeypatch):
    monkeypatch.setattr(module, "device_count", lambda: 2)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)


def visible_devices(parent):
    """What each server that this process started may see."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    found = [Path(f"/proc/{child}/environ").read_bytes().split(b"\0") for child in children]
    return {word.decode() for words in found for word in words if word.startswith(b"CUDA_VISIBLE_DEVICES=")}


@pytest.mark.skipif(torch.cuda.is_available(), reason="compares with the CPU")
def test_two_servers_have_a_device_each_and_give_the_bytes_of_the_codec_here(config):
    video = np.random.default_rng(0).uniform(-1, 1, (5, 32, 32, 3)).astype(np.float32)
    wanted = make_codec(config).encode_many([video, video[::-1].copy()])
    with codec_servers(config, 2) as address:
        assert visible_devices(os.getpid()) == {"CUDA_VISIBLE_DEVICES=0", "CUDA_VISIBLE_DEVICES=1"}
        found = ServedCodec(address).encode_many([video, video[::-1].copy()])
        assert ServedCodec(address).describe() == make_codec(config).describe()
    assert [one.tobytes() for one in found] == [one.tobytes() for one in wanted]
    assert not Path(address).exists()


def test_servers_that_were_killed_are_told_to_who_asks(config):
    with codec_servers(config, 1) as address:
        (child,) = [
            int(one)
            for one in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()
            if b"codec_servers" in Path(f"/proc/{one}/cmdline").read_bytes()
        ]
        os.kill(child, signal.SIGKILL)
        os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)
        with pytest.raises(WsmError, match="the process that holds the codec ended"):
            ServedCodec(address).describe()


def test_a_codec_that_cannot_be_loaded_ends_the_stage_before_its_work(config, tmp_path, capfd):
    broken = CodecConfig(name="wan", weights=str(tmp_path))
    with pytest.raises(WsmError, match="ended before it could"), codec_servers(broken, 1):
        pass
    assert "codec.weights must name a local folder" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("changes", "gpus", "said"),
    [
        ({"name": "dct"}, 1, "--gpus is for codec wan, found dct"),
        ({"name": "wan", "device": "cpu"}, 1, "found wan on cpu"),
        ({"name": "wan"}, 3, "--gpus 3 needs as many CUDA devices on this machine, found 2"),
    ],
)
def test_what_no_gpu_can_do_is_refused_before_any_work(changes, gpus, said):
    with pytest.raises(ConfigError, match=said):
        module.require_gpus(CodecConfig(**changes), gpus)


def test_gpus_are_of_this_machine():
    with pytest.raises(ConfigError, match="--engine ray works on others"):
        StageRequest(engine=EngineName.RAY, options=RunOptions(gpus=1))
