"""One layer of one expert: the halves before and after the joint attention.

Order and arithmetic are those of a Wan2.2 block: modulated self-attention, cross-attention behind an affine norm and
without a gate, modulated feed-forward network.

Shape suffixes: B batch, G copies of a frame, F latent frames, P tokens of a frame, D width of the expert, H heads, d
width of a head, S tokens of the context.
"""

from collections.abc import Callable

import torch
from torch import Tensor, nn
from torch.nn.functional import layer_norm, rms_norm, scaled_dot_product_attention

from wsm_model.config import Expert, ModelConfig, Variant
from wsm_model.layers.modulation import gated_sum, modulated_norm
from wsm_model.layers.rope import rotate
from wsm_model.layers.time_embedding import MODULATIONS
from wsm_model.mot.attention import QueriesKeysValues


def sees_goal(config: ModelConfig, expert: Expert) -> bool:
    """Whether predictions of an expert attend to the goal: RGB alone, and without SLAM the poses too."""
    return expert is Expert.GENERATION or (expert is Expert.POSE and config.variant is Variant.IDM)


class Projections(nn.Module):
    """Queries, keys and values with RMS norms over the whole width, and the way back.

    Args:
        width: of the tokens that ask.
        context_width: of the tokens that are asked.
        config: heads and eps.
    """

    def __init__(self, width: int, context_width: int, config: ModelConfig):
        super().__init__()
        self.heads = config.heads
        inner = config.attention_width
        self.to_q = nn.Linear(width, inner)
        self.to_k = nn.Linear(context_width, inner)
        self.to_v = nn.Linear(context_width, inner)
        self.to_out = nn.Linear(inner, width)
        self.norm_q = nn.RMSNorm(inner, eps=config.norm_eps)
        self.norm_k = nn.RMSNorm(inner, eps=config.norm_eps)

    def queries(self, x: Tensor) -> Tensor:
        """Queries [..., H, d] of tokens [..., D]."""
        return _normed(self.norm_q, self.to_q(x)).unflatten(-1, (self.heads, -1))

    def keys(self, x: Tensor) -> Tensor:
        """Keys [..., H, d] of tokens."""
        return _normed(self.norm_k, self.to_k(x)).unflatten(-1, (self.heads, -1))

    def values(self, x: Tensor) -> Tensor:
        """Values [..., H, d] of tokens."""
        return self.to_v(x).unflatten(-1, (self.heads, -1))

    def out(self, x: Tensor) -> Tensor:
        """The way back: [..., H d] to [..., D]."""
        found: Tensor = self.to_out(x)
        return found


class CrossAttention(Projections):
    """What the tokens of a frame gather from its context, behind an affine norm and without a gate.

    Args:
        width: D.
        config: the model.
    """

    def __init__(self, width: int, config: ModelConfig):
        super().__init__(width, config.generation.width, config)
        self.norm = nn.LayerNorm(width, eps=config.norm_eps)

    def forward(self, x_BFPD: Tensor, context_BFSD: Tensor) -> Tensor:
        """Change of tokens [B, F, P, D] by context tokens [B, F, S, D of the generation expert]."""
        with torch.autocast(x_BFPD.device.type, enabled=False):
            weight, bias = self.norm.weight.float(), self.norm.bias.float()
            normed = layer_norm(x_BFPD.float(), weight.shape, weight, bias, self.norm.eps).to(x_BFPD.dtype)
        parts = (self.queries(normed), self.keys(context_BFSD), self.values(context_BFSD))
        queries, keys, values = (part.transpose(-3, -2).to(parts[2].dtype) for part in parts)
        found = scaled_dot_product_attention(queries, keys, values)
        return self.to_out(found.transpose(-3, -2).flatten(-2)).to(x_BFPD.dtype)


class OneTokenAttention(nn.Module):
    """`CrossAttention` to a single token, exactly: the softmax over one key is 1, whatever is asked.

    So queries, keys and the norms before them have no part in what comes out, and no gradient: at the paper's size
    566 million parameters, which are neither kept nor trained.

    Args:
        width: D.
        config: the model.
    """

    def __init__(self, width: int, config: ModelConfig):
        super().__init__()
        self.to_v = nn.Linear(config.generation.width, config.attention_width)
        self.to_out = nn.Linear(config.attention_width, width)

    def forward(self, x_BFPD: Tensor, context_BF1D: Tensor) -> Tensor:
        """Change of tokens [B, F, P, D] by the one token [B, F, 1, D of the generation expert]: the same for all P."""
        return self.to_out(self.to_v(context_BF1D)).to(x_BFPD.dtype)


class ExpertBlock(nn.Module):
    """A transformer layer of one expert.

    Args:
        config: the model.
        expert: which expert.
    """

    def __init__(self, config: ModelConfig, expert: Expert):
        super().__init__()
        widths = config.expert(expert)
        self.eps = config.norm_eps
        self.attention = Projections(widths.width, widths.width, config)
        is_own = config.own_dream_attention and expert is Expert.GENERATION
        self.dream_attention = Projections(widths.width, widths.width, config) if is_own else None
        self.table = nn.Parameter(torch.randn(MODULATIONS, widths.width) / widths.width**0.5)
        self.feed_forward = nn.Sequential(
            nn.Linear(widths.width, widths.feed_forward_width),
            nn.GELU(approximate="tanh"),
            nn.Linear(widths.feed_forward_width, widths.width),
        )
        across = OneTokenAttention if config.goal_tokens == 1 else CrossAttention
        self.cross_attention = across(widths.width, config) if sees_goal(config, expert) else None

    def before_attention(
        self, x: Tensor, modulation: Tensor, rope: tuple[Tensor, Tensor], prediction: int | None
    ) -> QueriesKeysValues:
        """Queries, keys and values of tokens.

        Args:
            x: [B, G, F, P, D].
            modulation: float32 [B, G, F, 1 or P, 6, D], without the layer's own table.
            rope: cosine and sine, float32, broadcastable to [B, G, F, P, d / 2].
            prediction: which of the G copies are predictions; None where none are.
        """
        shift, scale, _ = self._modulation(modulation, 0)
        normed = modulated_norm(x, shift, scale, self.eps)
        queries = self._project(normed, prediction, Projections.queries)
        keys = self._project(normed, prediction, Projections.keys)
        values = self._project(normed, prediction, Projections.values)
        return QueriesKeysValues(rotate(queries, rope).to(values.dtype), rotate(keys, rope).to(values.dtype), values)

    def after_attention(
        self, x: Tensor, gathered: Tensor, modulation: Tensor, context: Tensor | None, prediction: int | None
    ) -> Tensor:
        """The rest of the layer.

        Args:
            x: tokens as they came, [B, G, F, P, D].
            gathered: what they gathered in the joint attention, [B, G, F, P, H, d].
            modulation: as for `before_attention`.
            context: what predictions of each frame attend to, [B, F, S, D of the generation expert].
            prediction: which of the G copies are predictions; None where none are.

        Raises:
            ValueError: predictions of this expert see the goal, and there is no context.
        """
        _, _, gate = self._modulation(modulation, 0)
        found = self._project(gathered.flatten(-2).to(x.dtype), prediction, Projections.out)
        x = gated_sum(x, found, gate)
        if self.cross_attention is not None and prediction is not None:
            if context is None:
                raise ValueError("predictions of this expert see the goal: give its tokens as context")
            copies = list(x.unbind(1))
            copies[prediction] = copies[prediction] + self.cross_attention(copies[prediction], context)
            x = torch.stack(copies, dim=1)
        shift, scale, gate = self._modulation(modulation, 3)
        return gated_sum(x, self.feed_forward(modulated_norm(x, shift, scale, self.eps)), gate)

    def _project(self, x: Tensor, prediction: int | None, project: Callable[[Projections, Tensor], Tensor]) -> Tensor:
        """Each copy by its own matrices: predictions by those of dreams, where the expert has such."""
        if self.dream_attention is None or prediction is None:
            return project(self.attention, x)
        return torch.stack(
            [
                project(self.dream_attention if copy == prediction else self.attention, part)
                for copy, part in enumerate(x.unbind(1))
            ],
            dim=1,
        )

    def _modulation(self, modulation: Tensor, first: int) -> tuple[Tensor, Tensor, Tensor]:
        three = modulation[..., first : first + 3, :] + self.table[first : first + 3].float()
        shift, scale, gate = three.unbind(-2)
        return shift, scale, gate


def _normed(norm: nn.RMSNorm, x: Tensor) -> Tensor:
    """The norm in float32, rounded once to the dtype of x."""
    return rms_norm(x.float(), norm.normalized_shape, norm.weight.float(), norm.eps).to(x.dtype)
