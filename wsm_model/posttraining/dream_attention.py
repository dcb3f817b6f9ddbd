"""A pretrained model with matrices of their own for dreams: what post-training starts from."""

from dataclasses import replace

import torch

from wsm_model.config import Expert
from wsm_model.model import WorldSlamModel

_OF_SEEN = f".experts.{Expert.GENERATION.value}.attention."
_OF_DREAMS = f".experts.{Expert.GENERATION.value}.dream_attention."


def with_dream_attention(model: WorldSlamModel) -> WorldSlamModel:
    """The same model, whose self-attention of the generation expert is there twice: for what was seen, and for dreams.

    Both are equal, so it computes the same. All other weights are shared with `model`. A model that has such matrices
    already is returned as it is, so that a post-trained one can be post-trained further.
    """
    if model.config.own_dream_attention:
        return model
    tensors = dict(model.state_dict())
    for name in list(tensors):
        if _OF_SEEN in name:
            tensors[name.replace(_OF_SEEN, _OF_DREAMS)] = tensors[name].clone()
    with torch.device("meta"):
        doubled = WorldSlamModel(replace(model.config, own_dream_attention=True), model.attention)
    doubled.load_state_dict(tensors, assign=True)
    return doubled.train(model.training)
