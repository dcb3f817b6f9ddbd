"""The experts' layers side by side, with whatever attention joins them."""

from collections.abc import Callable, Mapping
from typing import cast

import torch
from torch import Tensor, nn
from torch.utils.checkpoint import checkpoint

from wsm_model.config import Expert, ModelConfig
from wsm_model.layers.goal import GoalEmbedding
from wsm_model.mot.attention import Attended, JointTokens
from wsm_model.mot.expert import ExpertTransformer, Stream

Attend = Callable[[int, JointTokens], Attended]
"""Joint attention of a layer: its number and the tokens of every expert to what they gather."""

Streams = Mapping[Expert, Stream]


class MixtureOfTransformers(nn.Module):
    """Three experts with parameters of their own and one joint self-attention in every layer (paper, section 3.2).

    Args:
        config: the model.
    """

    def __init__(self, config: ModelConfig):
        super().__init__()
        self.config = config
        self.experts = nn.ModuleDict({expert.value: ExpertTransformer(config, expert) for expert in config.experts})
        self.goal = GoalEmbedding(config.goal_frequencies, config.goal_base_rad_per_m, config.generation.width)
        self.checkpoint_activations = False

    def expert(self, expert: Expert) -> ExpertTransformer:
        """One expert."""
        return cast(ExpertTransformer, self.experts[expert.value])

    def run(self, streams: Streams, attend: Attend, context: Tensor | None) -> dict[Expert, Stream]:
        """All layers.

        Args:
            streams: tokens of the experts that take part.
            attend: the joint attention.
            context: goal tokens of each frame, [B, F, S, D of the generation expert].
        """
        tokens = {expert: stream.x for expert, stream in streams.items()}
        for number in range(self.config.layers):
            if self.checkpoint_activations and torch.is_grad_enabled():
                tokens = checkpoint(self._layer, number, tokens, streams, attend, context, use_reentrant=False)
            else:
                tokens = self._layer(number, tokens, streams, attend, context)
        return {expert: stream.with_tokens(tokens[expert]) for expert, stream in streams.items()}

    def _layer(
        self, number: int, tokens: dict[Expert, Tensor], streams: Streams, attend: Attend, context: Tensor | None
    ) -> dict[Expert, Tensor]:
        blocks = {expert: self.expert(expert).block(number) for expert in streams}
        asked = {
            expert: blocks[expert].before_attention(tokens[expert], stream.modulation, stream.rope)
            for expert, stream in streams.items()
        }
        gathered = attend(number, asked)
        return {
            expert: blocks[expert].after_attention(
                tokens[expert], gathered[expert], stream.modulation, context, stream.prediction
            )
            for expert, stream in streams.items()
        }
