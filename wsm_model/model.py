"""The World SLAM Model: one teacher-forced pass over whole sequences.

Shape suffixes: B rows, G copies of a frame (clean, prediction), F latents of a row, N sequences, M pose slots.
"""

from collections.abc import Callable
from enum import StrEnum
from functools import partial

import torch
from torch import Tensor

from wsm_data.schema.sequence import FrameTable
from wsm_model.config import Expert, ModelConfig
from wsm_model.flow import velocity_of
from wsm_model.inputs import ModelInputs, ModelOutputs
from wsm_model.layers.pose import identity_poses
from wsm_model.mot.attention import JointTokens, attend_densely
from wsm_model.mot.attention_blocks import PREDICTION, attend_by_blocks, plan_blocks
from wsm_model.mot.attention_flex import attend_flexibly, block_mask
from wsm_model.mot.expert import Stream
from wsm_model.mot.layer import Attend
from wsm_model.mot.mask import dense_mask
from wsm_model.mot.transformer import MixtureOfTransformers

FLOW_TIME_SCALE = 1000.0
"""Timesteps of Wan2.2 are flow times on the 0..1000 scale."""


class Attention(StrEnum):
    """How the joint attention is evaluated; the result is the same."""

    AUTO = "auto"
    DENSE = "dense"
    BLOCKS = "blocks"
    FLEX = "flex"


class WorldSlamModel(MixtureOfTransformers):
    """Dreams RGB, and estimates depth and camera poses of what it saw and dreamed (paper, section 3.2).

    Args:
        config: the model.
        attention: `auto` is `flex` on a GPU and `blocks` elsewhere.
    """

    def __init__(self, config: ModelConfig, attention: Attention = Attention.AUTO):
        super().__init__(config)
        self.attention = attention

    def forward(self, inputs: ModelInputs) -> ModelOutputs:
        """Predict every chunk of every sequence at once, each from what it may see.

        Raises:
            ValueError: the sequences do not fit the rows.
        """
        table = inputs.table
        streams = self.training_streams(inputs, table)
        context = self.goal_context(inputs.goal_camera0_m, table)
        attend = self._attend(inputs, table, context.device)
        done = self.run(streams, attend, context)
        read = self.expert(Expert.GENERATION).read(done[Expert.GENERATION])
        return ModelOutputs(
            velocity=velocity_of(self.config.prediction, read, inputs.noisy_rgb, inputs.flow_time),
            depth=self.expert(Expert.DEPTH).read(done[Expert.DEPTH]) if Expert.DEPTH in done else None,
            poses=self.expert(Expert.POSE).read(done[Expert.POSE]),
        )

    def training_streams(self, inputs: ModelInputs, table: FrameTable) -> dict[Expert, Stream]:
        """Clean and prediction tokens of all experts: noisy RGB, and state queries of zero depth and identity pose."""
        index = torch.from_numpy(table.latent).to(inputs.rgb.device)
        clean_time = torch.zeros_like(inputs.flow_time)
        rgb_time = torch.stack([clean_time, inputs.flow_time * FLOW_TIME_SCALE], dim=1)
        state_time = torch.stack(
            [
                torch.full_like(clean_time, self.config.clean_state_time),
                torch.full_like(clean_time, self.config.state_query_time),
            ],
            dim=1,
        )
        depth = inputs.depth if inputs.depth_context is None else inputs.depth_context
        rgb = inputs.rgb if inputs.rgb_context is None else inputs.rgb_context
        values = {
            Expert.GENERATION: torch.stack([rgb, inputs.noisy_rgb], dim=1),
            Expert.POSE: torch.stack(
                [inputs.poses, identity_poses(*inputs.poses.shape[:-1], device=inputs.poses.device)], dim=1
            ),
        }
        if Expert.DEPTH in self.config.experts:
            if depth is None:
                raise ValueError("a model with SLAM needs inputs with depth, found none")
            values[Expert.DEPTH] = torch.stack([depth, torch.zeros_like(depth)], dim=1)
        return {
            expert: self.expert(expert).stream(
                values[expert], rgb_time if expert is Expert.GENERATION else state_time, index, PREDICTION
            )
            for expert in self.config.experts
        }

    def goal_context(self, goal_camera0_m: Tensor, table: FrameTable) -> Tensor:
        """The goal token of each frame's sequence, [B, F, 1, D]; padding frames take that of the first sequence."""
        tokens = self.goal(goal_camera0_m)
        return tokens[torch.from_numpy(table.sequence).clamp(min=0).to(tokens.device)].unsqueeze(2)

    def _attend(self, inputs: ModelInputs, table: FrameTable, device: torch.device) -> Attend:
        evaluate: Callable[[JointTokens], dict[Expert, Tensor]]
        kind = self.attention
        if kind is Attention.AUTO:
            kind = Attention.FLEX if device.type == "cuda" else Attention.BLOCKS
        if kind is Attention.FLEX:
            evaluate = partial(attend_flexibly, mask=block_mask(self.config, table, device))
        elif kind is Attention.BLOCKS:
            evaluate = partial(attend_by_blocks, plan=plan_blocks(self.config, inputs.spans, device))
        else:
            evaluate = partial(attend_densely, mask_BLL=dense_mask(self.config, table))
        return lambda _layer, tokens: evaluate(tokens)
