import json
import shutil

import numpy as np
import pytest

from wsm_data.codecs.registry import CodecConfig, describe_codec, make_codec
from wsm_data.errors import ConfigError

torch = pytest.importorskip("torch")
diffusers = pytest.importorskip("diffusers")

CHANNELS = 48
TOLERANCE = {"float32": 2e-5, "bfloat16": 0.06}
"""Largest difference of latents between batches of other sizes: some roundings of the dtype (2^-24 and 2^-9) at latents
of about one, through some thirty layers."""


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """A folder with a VAE of the real structure, narrow and with random weights."""
    from wsm_data.codecs.wan import GEOMETRY

    torch.manual_seed(0)
    statistics = {"latents_mean": [0.01 * i for i in range(CHANNELS)], "latents_std": [1 + 0.1 * i for i in range(48)]}
    vae = diffusers.AutoencoderKLWan(**GEOMETRY, base_dim=8, decoder_base_dim=8, **statistics)
    folder = tmp_path_factory.mktemp("wan") / "vae"
    vae.save_pretrained(folder, safe_serialization=True)
    return folder


@pytest.fixture(scope="module")
def codec(weights):
    return make_codec(CodecConfig(name="wan", weights=str(weights), device="cpu"))


@pytest.fixture
def copy_of_weights(weights, tmp_path):
    return shutil.copytree(weights, tmp_path / "copy")


def edit_config(folder, **changes):
    path = folder / "config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def load(folder, **settings):
    return make_codec(CodecConfig(name="wan", weights=str(folder), device="cpu", **settings))


@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_shapes_and_dtypes_are_those_of_the_contract(weights, noise_video, dtype):
    codec = load(weights, dtype=dtype)
    latents = codec.encode(noise_video)
    assert latents.dtype == np.float32
    assert latents.shape == (3, CHANNELS, 2, 4)
    decoded = codec.decode(latents)
    assert decoded.dtype == np.float32
    assert decoded.shape == noise_video.shape
    assert np.abs(decoded).max() <= 1


def test_latents_are_the_mean_of_the_posterior_and_not_a_sample(codec, weights, noise_video):
    vae = diffusers.AutoencoderKLWan.from_pretrained(weights, local_files_only=True, use_safetensors=True).eval()
    with torch.inference_mode():
        posterior = vae.encode(torch.from_numpy(noise_video).permute(3, 0, 1, 2)[None]).latent_dist
    wanted = posterior.mean[0].permute(1, 0, 2, 3).numpy()
    assert np.array_equal(codec.encode(noise_video), wanted)
    assert np.array_equal(codec.encode(noise_video), codec.encode(noise_video))


def test_decoding_is_that_of_the_network(codec, weights):
    latents = np.random.default_rng(1).normal(size=(2, CHANNELS, 2, 2)).astype(np.float32)
    vae = diffusers.AutoencoderKLWan.from_pretrained(weights, local_files_only=True, use_safetensors=True).eval()
    with torch.inference_mode():
        wanted = vae.decode(torch.from_numpy(latents).permute(1, 0, 2, 3)[None]).sample[0].permute(1, 2, 3, 0)
    assert np.array_equal(codec.decode(latents), wanted.numpy())


@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_a_batch_of_unequal_clips_equals_each_alone(weights, noise_video, dtype):
    clips = [noise_video[:5], noise_video, noise_video[4:5], noise_video[:5, ::-1].copy()]
    alone = [load(weights, dtype=dtype).encode(clip) for clip in clips]
    for batch_clips in (2, 4):
        together = load(weights, dtype=dtype, batch_clips=batch_clips).encode_many(clips)
        for one, other in zip(alone, together, strict=True):
            assert one.shape == other.shape
            np.testing.assert_allclose(one, other, atol=TOLERANCE[dtype])


@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_by_default_the_latents_of_a_clip_do_not_depend_on_what_else_is_encoded(weights, noise_video, dtype):
    codec = load(weights, dtype=dtype)
    depth = np.broadcast_to(noise_video[..., :1], noise_video.shape)
    pairs = [(noise_video[:5], depth[:5]), (noise_video, depth), (noise_video[4:9], depth[4:9])]
    together = codec.encode_many([video for pair in pairs for video in pair])
    for number, pair in enumerate(pairs):
        for one, other in zip(codec.encode_many(pair), together[2 * number : 2 * number + 2], strict=True):
            assert np.array_equal(one, other)


def test_colour_and_depth_of_a_clip_are_one_batch(weights, noise_video, monkeypatch):
    codec, sizes = load(weights), []
    encode = codec.vae.encode
    monkeypatch.setattr(codec.vae, "encode", lambda x: sizes.append(tuple(x.shape[:3])) or encode(x))
    codec.encode_many([noise_video[:5], noise_video[:5], noise_video, noise_video])
    assert sizes == [(2, 3, 9), (2, 3, 5)]


def test_a_description_needs_no_network(weights, monkeypatch):
    wanted = load(weights).describe()
    monkeypatch.setattr("wsm_data.codecs.wan.AutoencoderKLWan.load_state_dict", None)
    assert describe_codec(CodecConfig(name="wan", weights=str(weights), device="cpu")) == wanted


def test_the_tolerance_of_batches_tells_clips_apart(codec, noise_video):
    difference = codec.encode(noise_video[:5]) - codec.encode(noise_video[:5, ::-1].copy())
    assert np.abs(difference).max() > 2 * TOLERANCE["bfloat16"]


def test_a_prefix_of_a_video_has_a_prefix_of_its_latents(codec, noise_video):
    whole = codec.encode(noise_video)
    for j in range(3):
        np.testing.assert_allclose(codec.encode(noise_video[: 1 + 4 * j]), whole[: 1 + j], atol=TOLERANCE["float32"])


def test_a_prefix_of_latents_is_decoded_to_a_prefix_of_the_video(codec, noise_video):
    latents = codec.encode(noise_video)
    whole = codec.decode(latents)
    for j in range(3):
        np.testing.assert_allclose(codec.decode(latents[: 1 + j]), whole[: 1 + 4 * j], atol=TOLERANCE["float32"])


def test_one_clip_leaves_no_trace_in_the_next(codec, noise_video, smooth_video):
    before = codec.encode(noise_video)
    codec.encode(smooth_video)
    assert np.array_equal(codec.encode(noise_video), before)


def test_no_clips_give_no_latents(codec):
    assert codec.encode_many([]) == []


def test_a_depth_video_that_repeats_one_channel_is_encoded_as_if_written_out(codec, noise_video):
    view = np.broadcast_to(noise_video[..., :1], noise_video.shape)
    assert np.array_equal(codec.encode(view), codec.encode(np.ascontiguousarray(view)))


def test_frames_that_would_be_dropped_in_silence_are_refused(codec, noise_video):
    with pytest.raises(ValueError, match="1 \\+ 4k frames, found 8"):
        codec.encode(noise_video[:8])


def test_clips_of_two_sizes_in_one_call_are_refused(codec, noise_video):
    with pytest.raises(ValueError, match="one size"):
        codec.encode_many([noise_video, noise_video[:, :, :32]])


def test_the_description_carries_the_statistics_of_the_config(codec):
    info = codec.describe()
    assert (info.name, info.channels, info.temporal_ratio, info.spatial_ratio) == ("wan", 48, 4, 16)
    assert info.latent_mean[2] == 0.02
    assert info.latent_std[10] == 2.0


def test_the_digest_covers_weights_config_and_dtype_and_nothing_else(codec, weights, copy_of_weights):
    digest = codec.describe().digest
    assert load(copy_of_weights, batch_clips=3).describe().digest == digest
    assert load(weights, dtype="bfloat16").describe().digest != digest
    edit_config(copy_of_weights, _diffusers_version="99", a_stray_key=1)
    assert load(copy_of_weights).describe().digest == digest
    edit_config(copy_of_weights, latents_mean=[0.0] * CHANNELS)
    assert load(copy_of_weights).describe().digest != digest


def test_one_changed_byte_of_the_weights_changes_the_digest(codec, copy_of_weights):
    path = copy_of_weights / "diffusion_pytorch_model.safetensors"
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)
    assert load(copy_of_weights).describe().digest != codec.describe().digest


def test_weights_in_several_files_give_the_same_latents(codec, weights, tmp_path, noise_video):
    vae = diffusers.AutoencoderKLWan.from_pretrained(weights, local_files_only=True, use_safetensors=True)
    vae.save_pretrained(tmp_path / "sharded", safe_serialization=True, max_shard_size="200KB")
    assert len(list((tmp_path / "sharded").glob("*.safetensors"))) > 1
    assert np.array_equal(load(tmp_path / "sharded").encode(noise_video), codec.encode(noise_video))


@pytest.mark.parametrize(
    ("field", "found"), [("z_dim", 16), ("patch_size", None), ("is_residual", False), ("scale_factor_spatial", 8)]
)
def test_another_geometry_is_refused_by_field_with_both_values(copy_of_weights, field, found):
    from wsm_data.codecs.wan import GEOMETRY

    edit_config(copy_of_weights, **{field: found})
    with pytest.raises(ConfigError, match=f"{field} must be {GEOMETRY[field]}, found {found}"):
        load(copy_of_weights)


def test_statistics_of_another_length_are_refused(copy_of_weights):
    edit_config(copy_of_weights, latents_std=[1.0] * 16)
    with pytest.raises(ConfigError, match="latents_std must hold 48 numbers, found 16"):
        load(copy_of_weights)


def test_no_folder_named_is_refused():
    with pytest.raises(ConfigError, match=r"codec\.weights"):
        load("")


def test_a_folder_without_config_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"config\.json"):
        load(tmp_path)


def test_a_config_that_is_no_json_is_refused(copy_of_weights):
    (copy_of_weights / "config.json").write_text("{")
    with pytest.raises(ConfigError, match="must be JSON"):
        load(copy_of_weights)


def test_a_folder_with_pickled_weights_alone_is_refused(copy_of_weights):
    stored = copy_of_weights / "diffusion_pytorch_model.safetensors"
    stored.rename(copy_of_weights / "diffusion_pytorch_model.bin")
    with pytest.raises(ConfigError, match=r"missing: diffusion_pytorch_model\.safetensors"):
        load(copy_of_weights)


def test_an_index_that_names_a_file_that_is_not_there_is_refused(copy_of_weights):
    index = {"weight_map": {"encoder.conv_in.weight": "part-2.safetensors"}}
    (copy_of_weights / "diffusion_pytorch_model.safetensors.index.json").write_text(json.dumps(index))
    with pytest.raises(ConfigError, match=r"missing: part-2\.safetensors"):
        load(copy_of_weights)


@pytest.mark.parametrize("damage", ["cut", "narrower", "a tensor less", "a tensor more"])
def test_weights_that_do_not_fill_the_network_are_refused(copy_of_weights, damage):
    from safetensors.torch import load_file, save_file

    path = copy_of_weights / "diffusion_pytorch_model.safetensors"
    if damage == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif damage == "narrower":
        edit_config(copy_of_weights, base_dim=4)
    else:
        tensors = load_file(path)
        if damage == "a tensor less":
            del tensors["quant_conv.bias"]
        else:
            tensors["stray"] = torch.zeros(1)
        save_file(tensors, path)
    with pytest.raises(ConfigError, match="do not fit"):
        load(copy_of_weights)


def test_another_dtype_is_refused(weights):
    with pytest.raises(ConfigError, match="float32, bfloat16, found 'float16'"):
        load(weights, dtype="float16")


@pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a CUDA device")
def test_a_device_that_is_not_there_is_refused(weights):
    with pytest.raises(ConfigError, match="no CUDA device"):
        make_codec(CodecConfig(name="wan", weights=str(weights), device="cuda"))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device")
@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_a_gpu_gives_the_latents_of_the_cpu(weights, noise_video, dtype):
    on_gpu = make_codec(CodecConfig(name="wan", weights=str(weights), device="cuda", dtype=dtype))
    difference = on_gpu.encode(noise_video) - load(weights, dtype=dtype).encode(noise_video)
    assert np.abs(difference).max() < {"float32": 2e-3, "bfloat16": 0.12}[dtype]  # TF32 convolutions: 2^-11


def encoded_by_latents(codec, videos, *, is_stored=False):
    """Latents of videos that come frame by frame, in turn, each with a state of its own."""
    states, found = [None] * len(videos), [[] for _ in videos]
    for first, end in ((0, 1), (1, 5), (5, 9)):
        for number, video in enumerate(videos):
            latent, state = codec.encode_next(video[first:end], states[number])
            found[number].append(latent)
            states[number] = codec.restored(state.arrays()) if is_stored else state
    return [np.stack(latents) for latents in found]


@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_videos_that_come_frame_by_frame_have_the_latents_of_the_wholes(weights, noise_video, dtype):
    codec, videos = load(weights, dtype=dtype), [noise_video, noise_video[:, ::-1].copy()]
    for video, found in zip(videos, encoded_by_latents(codec, videos), strict=True):
        np.testing.assert_allclose(found, codec.encode(video), atol=TOLERANCE[dtype])
    assert np.abs(codec.encode(videos[0]) - codec.encode(videos[1])).max() > 5 * TOLERANCE[dtype]


@pytest.mark.parametrize("dtype", ["float32", "bfloat16"])
def test_a_state_that_was_stored_goes_on_in_the_same_bits(weights, noise_video, dtype):
    codec = load(weights, dtype=dtype)
    for kept, stored in zip(
        encoded_by_latents(codec, [noise_video]), encoded_by_latents(codec, [noise_video], is_stored=True), strict=True
    ):
        assert np.array_equal(kept, stored)


def test_encoding_on_from_a_state_leaves_it_as_it_was(codec, noise_video):
    _, state = codec.encode_next(noise_video[:1])
    once, _ = codec.encode_next(noise_video[1:5], state)
    again, after = codec.encode_next(noise_video[1:5], state)
    assert np.array_equal(once, again)
    assert (state.latents, after.latents) == (1, 2)


def test_a_state_of_another_codec_or_another_size_is_refused(codec, noise_video):
    _, state = codec.encode_next(noise_video[:1])
    with pytest.raises(ValueError, match="must have one size"):
        codec.encode_next(noise_video[1:5, :, :32], state)
    _, other = make_codec(CodecConfig()).encode_next(noise_video[:1])
    with pytest.raises(ValueError, match="a state of the codec wan"):
        codec.encode_next(noise_video[1:5], other)
