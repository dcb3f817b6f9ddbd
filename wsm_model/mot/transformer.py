"""The three experts: their ends, and the layers they share."""

from collections.abc import Iterator, Mapping
from typing import cast

import torch
from torch import Tensor, nn
from torch.utils.checkpoint import checkpoint

from wsm_model.config import Expert, ModelConfig
from wsm_model.layers.goal import GoalEmbedding
from wsm_model.mot.expert import ExpertEnds, Stream
from wsm_model.mot.layer import Attend, JointLayer

Streams = Mapping[Expert, Stream]


class MixtureOfTransformers(nn.Module):
    """Three experts with parameters of their own and one joint self-attention in every layer (paper, section 3.2).

    Args:
        config: the model.

    Attributes:
        checkpoint_activations: recompute each layer in the backward pass instead of keeping what is inside it.
    """

    def __init__(self, config: ModelConfig):
        super().__init__()
        self.config = config
        self.experts = nn.ModuleDict({expert.value: ExpertEnds(config, expert) for expert in config.experts})
        self.layers = nn.ModuleList(JointLayer(config, number) for number in range(config.layers))
        self.goal = GoalEmbedding(config.goal_frequencies, config.goal_base_rad_per_m, config.generation.width)
        self.checkpoint_activations = False

    def expert(self, expert: Expert) -> ExpertEnds:
        """The ends of one expert."""
        return cast(ExpertEnds, self.experts[expert.value])

    def run(self, streams: Streams, attend: Attend, context: Tensor | None) -> dict[Expert, Stream]:
        """All layers.

        Args:
            streams: tokens of the experts that take part.
            attend: the joint attention.
            context: goal tokens of each frame, [B, F, S, D of the generation expert].
        """
        tokens = {expert: stream.x for expert, stream in streams.items()}
        for layer in self.layers:
            if self.checkpoint_activations and torch.is_grad_enabled():
                tokens = checkpoint(layer, tokens, streams, attend, context, use_reentrant=False)
            else:
                tokens = layer(tokens, streams, attend, context)
        return {expert: stream.with_tokens(tokens[expert]) for expert, stream in streams.items()}


def parts_in_order(config: ModelConfig) -> Iterator[tuple[str, nn.Module]]:
    """The parts of a model one after another with their names, as its constructor makes them, from the same numbers.

    Whoever takes them one by one needs the memory of a single part.
    """
    for expert in config.experts:
        yield f"experts.{expert.value}", ExpertEnds(config, expert)
    for number in range(config.layers):
        yield f"layers.{number}", JointLayer(config, number)
    yield "goal", GoalEmbedding(config.goal_frequencies, config.goal_base_rad_per_m, config.generation.width)


def expert_of_parameter(name: str) -> Expert | None:
    """The expert whose parameter has this name in a state dict; None for the goal embedding."""
    words = name.split(".")
    place = {"experts": 1, "layers": 3}.get(words[0])
    return None if place is None else Expert(words[place])
