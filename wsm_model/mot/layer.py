"""One layer of all experts, with whatever attention joins them."""

from collections.abc import Callable, Mapping
from typing import cast

from torch import Tensor, nn

from wsm_model.config import Expert, ModelConfig
from wsm_model.mot.attention import Attended, JointTokens
from wsm_model.mot.block import ExpertBlock
from wsm_model.mot.expert import Stream

Attend = Callable[[int, JointTokens], Attended]
"""Joint attention of a layer: its number and the tokens of every expert to what they gather."""


class JointLayer(nn.Module):
    """The blocks of all experts at one depth: one module, so that it is sharded, gathered and recomputed as a whole.

    Args:
        config: the model.
        number: of the layer, from 0.
    """

    def __init__(self, config: ModelConfig, number: int):
        super().__init__()
        self.number = number
        self.experts = nn.ModuleDict({expert.value: ExpertBlock(config, expert) for expert in config.experts})

    def forward(
        self,
        tokens: Mapping[Expert, Tensor],
        streams: Mapping[Expert, Stream],
        attend: Attend,
        context: Tensor | None,
    ) -> dict[Expert, Tensor]:
        """Tokens of the experts that take part, [B, G, F, P, D] each, one layer further.

        Args:
            tokens: as they come.
            streams: times, positions and copies of those tokens.
            attend: the joint attention.
            context: goal tokens of each frame, [B, F, S, D of the generation expert].
        """
        blocks = {expert: cast(ExpertBlock, self.experts[expert.value]) for expert in streams}
        asked = {
            expert: blocks[expert].before_attention(tokens[expert], stream.modulation, stream.rope, stream.prediction)
            for expert, stream in streams.items()
        }
        gathered = attend(self.number, asked)
        return {
            expert: blocks[expert].after_attention(
                tokens[expert], gathered[expert], stream.modulation, context, stream.prediction
            )
            for expert, stream in streams.items()
        }
