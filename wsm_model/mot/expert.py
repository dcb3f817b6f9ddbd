"""The ends of one expert: what turns its inputs into tokens, and the head that reads its predictions.

Shape suffixes: B batch, G copies of a frame (clean, prediction), F latent frames, P tokens of a frame, D width of the
expert, C channels, h rows and w columns of a latent.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

from wsm_model.config import Expert, ModelConfig
from wsm_model.layers.modulation import modulated_norm
from wsm_model.layers.patches import cut_patches, join_patches
from wsm_model.layers.pose import PoseEmbedding, PoseHead
from wsm_model.layers.rope import frame_positions, rotary_tables, token_offsets
from wsm_model.layers.time_embedding import TimeEmbedding


@dataclass(frozen=True, kw_only=True)
class Stream:
    """Tokens of one expert on their way through the layers.

    Attributes:
        x: tokens [B, G, F, P, D].
        time: time embedding e, float32 [B, G, F, 1 or P, D].
        modulation: float32 [B, G, F, 1 or P, 6, D].
        rope: cosine and sine, float32 [B, 1, F, P, d / 2].
        prediction: which of the G copies are predictions; None where all are clean.
    """

    x: Tensor
    time: Tensor
    modulation: Tensor
    rope: tuple[Tensor, Tensor]
    prediction: int | None

    def with_tokens(self, x: Tensor) -> "Stream":
        """The same stream one layer further."""
        return replace(self, x=x)


class LatentHead(nn.Module):
    """Tokens [..., P, D] to latents [..., C, h, w]: norm, modulation by e with a table of its own, one Linear.

    Args:
        config: the model.
        width: D.
    """

    def __init__(self, config: ModelConfig, width: int):
        super().__init__()
        self.eps = config.norm_eps
        self.patch, self.rows = config.patch, config.latent_height // config.patch
        self.table = nn.Parameter(torch.randn(2, width) / width**0.5)
        self.projection = nn.Linear(width, config.patch_values)

    def forward(self, x: Tensor, time: Tensor) -> Tensor:
        """Read latents; `time` is e, broadcastable to x."""
        shift, scale = (self.table.float() + time.unsqueeze(-2)).unbind(-2)
        return join_patches(self.projection(modulated_norm(x, shift, scale, self.eps)), self.patch, self.rows)


class PatchEmbedding(nn.Linear):
    """Latents [..., C, h, w] to tokens [..., P, D]: one Linear per patch.

    Args:
        config: the model.
        width: D.
    """

    def __init__(self, config: ModelConfig, width: int):
        super().__init__(config.patch_values, width)
        self.patch = config.patch

    def forward(self, latents: Tensor) -> Tensor:
        """Embed latents."""
        return super().forward(cut_patches(latents, self.patch).to(self.weight.dtype))


class ExpertEnds(nn.Module):
    """What an expert has before and after the layers.

    Args:
        config: the model.
        expert: which expert.
    """

    def __init__(self, config: ModelConfig, expert: Expert):
        super().__init__()
        self.config, self.expert = config, expert
        width = config.expert(expert).width
        is_pose = expert is Expert.POSE
        self.embedding = PoseEmbedding(width) if is_pose else PatchEmbedding(config, width)
        self.time = TimeEmbedding(config.time_frequencies, width)
        self.head = PoseHead(width, config.pose_hidden, config.norm_eps) if is_pose else LatentHead(config, width)

    def stream(self, values: Tensor, time: Tensor, latent_index: Tensor, prediction: int | None) -> Stream:
        """Tokens of latents [B, G, F, C, h, w], or of poses [B, G, F, M, 7].

        Args:
            values: what the tokens stand for, standardised.
            time: timestep on the 0..1000 scale, [B, G, F] or, token by token, [B, G, F, P].
            latent_index: number of each latent in its sequence, [B, F].
            prediction: which of the G copies are predictions.
        """
        embedded, modulation = self.time(time if time.dim() == 4 else time.unsqueeze(-1))
        offsets = token_offsets(self.config, self.expert)
        positions = frame_positions(latent_index, offsets.to(latent_index.device)).unsqueeze(1)
        return Stream(
            x=self.embedding(values),
            time=embedded,
            modulation=modulation,
            rope=rotary_tables(positions, self.config.head_width, self.config.rope_theta),
            prediction=prediction,
        )

    def read(self, stream: Stream) -> Tensor:
        """What the prediction copy says: latents [B, F, C, h, w] or poses [B, F, M, 7].

        Raises:
            ValueError: the stream holds clean copies alone.
        """
        if stream.prediction is None:
            raise ValueError("clean tokens predict nothing: only a stream with a prediction copy can be read")
        return self.head(stream.x[:, stream.prediction], stream.time[:, stream.prediction])
