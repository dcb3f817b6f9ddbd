"""`wsm encode --gpus`: workers that ask a codec elsewhere write what those write that have it themselves."""

from dataclasses import replace

import pytest

from pipelines.artifacts import codec_servers
from pipelines.artifacts.layout import clips_folder
from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from wsm_data.codecs.registry import CodecConfig
from wsm_data.files.digest import sha256_file

torch = pytest.importorskip("torch")
diffusers = pytest.importorskip("diffusers")


@pytest.fixture
def codec(tmp_path):
    """A VAE of the real structure, narrow and with random weights."""
    from wsm_data.codecs.wan import GEOMETRY

    torch.manual_seed(0)
    statistics = {"latents_mean": [0.0] * 48, "latents_std": [1.0] * 48}
    vae = diffusers.AutoencoderKLWan(**GEOMETRY, base_dim=8, decoder_base_dim=8, **statistics)
    vae.save_pretrained(tmp_path / "vae", safe_serialization=True)
    return CodecConfig(name="wan", weights=str(tmp_path / "vae"))


def digests(out):
    folder = clips_folder(out)
    return {str(path.relative_to(folder)): sha256_file(path) for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_clips_are_the_same_with_a_codec_a_worker_and_with_one_a_gpu(mapped, codec, monkeypatch):
    torch.set_num_threads(1)
    monkeypatch.setattr(codec_servers, "device_count", lambda: 2)
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    config = replace(mapped.config("encode"), codec=codec)
    alone, served = (mapped.root / name for name in ("alone", "served"))
    run_stage(load_stage("encode"), config, alone, RunOptions(quiet=True))
    run_stage(load_stage("encode"), config, served, RunOptions(quiet=True, workers=2, gpus=2))
    assert digests(alone)
    assert digests(alone) == digests(served)
