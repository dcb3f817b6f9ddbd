"""Names of Wan2.2's transformer tensors, in the original layout and in that of diffusers, and ours for the same thing.

Cross-attention stands behind `norm3` in the original checkpoints and behind `norm2` in diffusers.
"""

import re
from collections.abc import Mapping
from types import MappingProxyType

_OUTER: Mapping[str, str] = MappingProxyType(
    {
        "patch_embedding": "embedding",
        # diffusers
        "condition_embedder.time_embedder.linear_1": "time.linear_1",
        "condition_embedder.time_embedder.linear_2": "time.linear_2",
        "condition_embedder.time_proj": "time.projection",
        "proj_out": "head.projection",
        "scale_shift_table": "head.table",
        # original
        "time_embedding.0": "time.linear_1",
        "time_embedding.2": "time.linear_2",
        "time_projection.1": "time.projection",
        "head.head": "head.projection",
        "head.modulation": "head.table",
    }
)
_IN_BLOCK: Mapping[str, str] = MappingProxyType(
    {
        # diffusers
        "attn1.to_out.0": "attention.to_out",
        "attn2.to_out.0": "cross_attention.to_out",
        "norm2": "cross_attention.norm",
        "ffn.net.0.proj": "feed_forward.0",
        "ffn.net.2": "feed_forward.2",
        "scale_shift_table": "table",
        # original
        "self_attn.o": "attention.to_out",
        "cross_attn.o": "cross_attention.to_out",
        "norm3": "cross_attention.norm",
        "ffn.0": "feed_forward.0",
        "ffn.2": "feed_forward.2",
        "modulation": "table",
    }
    | {f"attn1.{part}": f"attention.{part}" for part in ("to_q", "to_k", "to_v", "norm_q", "norm_k")}
    | {f"attn2.{part}": f"cross_attention.{part}" for part in ("to_q", "to_k", "to_v", "norm_q", "norm_k")}
    | {f"self_attn.{part}": f"attention.to_{part}" for part in "qkv"}
    | {f"cross_attn.{part}": f"cross_attention.to_{part}" for part in "qkv"}
    | {f"self_attn.{part}": f"attention.{part}" for part in ("norm_q", "norm_k")}
    | {f"cross_attn.{part}": f"cross_attention.{part}" for part in ("norm_q", "norm_k")}
)
_UNUSED = re.compile(r"(condition_embedder\.)?text_embedd(er|ing)\.")
_BLOCK = re.compile(r"blocks\.(\d+)\.(.+)")
_OUR_BLOCK = re.compile(r"layers\.(\d+)\.(.+)")
_IS_DIFFUSERS = re.compile(
    r"patch_embedding|condition_embedder\..*|proj_out|scale_shift_table|attn[12]\..*|norm2|ffn\.net\..*"
)
_THEIRS: Mapping[str, str] = MappingProxyType(
    {ours: theirs for theirs, ours in _OUTER.items() if _IS_DIFFUSERS.fullmatch(theirs)}
    | {f"goal.linear_{number}": f"condition_embedder.text_embedder.linear_{number}" for number in (1, 2)}
)
"""The other way round; the goal is embedded as a text is, by the same two layers."""
_THEIRS_IN_BLOCK: Mapping[str, str] = MappingProxyType(
    {ours: theirs for theirs, ours in _IN_BLOCK.items() if _IS_DIFFUSERS.fullmatch(theirs)}
)


def diffusers_name(name: str) -> str | None:
    """Name in the layout of diffusers of a tensor of ours, `{expert}` taken out; None where it has none there."""
    block = _OUR_BLOCK.fullmatch(name)
    words, table = (block[2], _THEIRS_IN_BLOCK) if block else (name, _THEIRS)
    lead = f"blocks.{block[1]}." if block else ""
    stem, suffix = _split(words)
    return f"{lead}{table[stem]}{suffix}" if stem in table else None


def is_unused(name: str) -> bool:
    """Whether a tensor belongs to the text embedding, which the goal replaces."""
    return _UNUSED.match(name) is not None


def our_name(name: str) -> str | None:
    """Name of a tensor in our state dict, with `{expert}` for the expert; None where it is not one of Wan2.2's."""
    block = _BLOCK.fullmatch(name)
    words, table = (block[2], _IN_BLOCK) if block else (name, _OUTER)
    lead = f"layers.{block[1]}.experts.{{expert}}." if block else "experts.{expert}."
    stem, suffix = _split(words)
    return f"{lead}{table[stem]}{suffix}" if stem in table else None


def _split(words: str) -> tuple[str, str]:
    """Stem and `.weight` or `.bias`; tables of modulation have neither."""
    for suffix in (".weight", ".bias"):
        if words.endswith(suffix):
            return words.removesuffix(suffix), suffix
    return words, ""
