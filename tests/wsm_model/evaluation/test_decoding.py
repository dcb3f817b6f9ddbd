import numpy as np
import torch

from wsm_data.codecs.dct import DctCodec
from wsm_data.schema.depth import DepthRange
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.evaluation.decoding import Decoding


def test_latents_are_decoded_with_the_mean_and_deviation_of_their_own_kind():
    """Standardised by the formula of the loader, and decoded: the pictures of the raw latents."""
    rng, codec = np.random.default_rng(0), DctCodec()
    raw = codec.encode(rng.uniform(-1, 1, (5, 32, 64, 3)).astype(np.float32))
    moments = {name: tuple(rng.uniform(0.5, 2.0, 48)) for name in ("rgb_mean", "rgb_std", "depth_mean", "depth_std")}
    standard = LatentStandard(codec="dct", codec_digest="d", **moments)
    decoding = Decoding(codec=codec, standard=standard, depth_range=DepthRange())

    def standardised(kind: str) -> torch.Tensor:
        mean, std = (np.array(moments[f"{kind}_{name}"])[:, None, None] for name in ("mean", "std"))
        return torch.from_numpy((raw - mean) / std)

    video = codec.decode(raw)
    levels = decoding.rgb_u8(standardised("rgb")).astype(int) - np.round((np.clip(video, -1, 1) + 1) * 127.5)
    assert np.abs(levels).max() <= 1  # float32 before the rounding to a level
    u = (np.clip(video.mean(-1), -1, 1) + 1) / 2
    wanted_m = 0.2 * (5 / 0.2) ** u  # specification, section 3, backwards
    np.testing.assert_allclose(decoding.depth_m(standardised("depth")), wanted_m, rtol=1e-4)
