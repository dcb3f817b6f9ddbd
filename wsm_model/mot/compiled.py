"""Layers in compiled form: the halves of every block before and after the joint attention, which compiles for itself.

The attention between them depends on the sequences of a batch and stays outside: what is compiled sees tensors alone,
with dynamic lengths, so that a run needs a handful of graphs.
"""

import torch

from wsm_model.mot.block import ExpertBlock
from wsm_model.mot.transformer import MixtureOfTransformers

_HALVES = ("before_attention", "after_attention")
_GRAPHS = 256


def compile_blocks(model: MixtureOfTransformers, backend: str = "inductor") -> None:
    """Compile the blocks of a model in place; they are compiled when they are first called.

    Beyond its limit of recompilations (8), torch would go on uncompiled without a word: the limit is raised, and what
    cannot be one graph is an error.
    """
    torch._dynamo.config.recompile_limit = max(_GRAPHS, torch._dynamo.config.recompile_limit)
    for block in model.modules():
        if isinstance(block, ExpertBlock):
            for half in _HALVES:
                compiled = torch.compile(getattr(block, half), dynamic=True, fullgraph=True, backend=backend)
                setattr(block, half, compiled)
