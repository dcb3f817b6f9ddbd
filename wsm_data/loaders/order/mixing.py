"""Sources mixed into one sequence: each in its own order, in the share its weight says, evenly all along the epoch."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from wsm_data.loaders.config import OrderConfig
from wsm_data.loaders.order.pass_order import SourceLayout, pass_order
from wsm_data.schema.arrays import Int64Array


def mixed_refs(layouts: Sequence[SourceLayout], order: OrderConfig, epoch: int) -> Int64Array:
    """Refs of an epoch in linear order: the sources' stretches, merged.

    A ref is the number of a clip over all sources, one source after the other.

    Args:
        layouts: the sources.
        order: how the clips of each are permuted.
        epoch: number of the epoch, from 0.

    Returns:
        int64 [clips of the epoch].
    """
    bases = np.cumsum([0, *(len(layout) for layout in layouts)])
    parts = [
        source_stretch(layout, order, source=source, epoch=epoch) + bases[source]
        for source, layout in enumerate(layouts)
    ]
    return parts[0] if len(parts) == 1 else _merge(parts)


def source_stretch(layout: SourceLayout, order: OrderConfig, *, source: int, epoch: int) -> Int64Array:
    """Clips that a source of N clips and weight w gives to an epoch.

    They are the stretch [round(e w N), round((e + 1) w N)) of the endless sequence of its passes, so that stretches of
    consecutive epochs join without a gap, and every pass brings each clip once, whatever the weight.

    Returns:
        numbers within the source, int64 [clips of the stretch].
    """
    clips = len(layout)
    if not clips:
        return np.empty(0, np.int64)
    first, last = stretch_of_epoch(clips, layout.weight, epoch)
    parts = [np.empty(0, np.int64)]
    for number in range(first // clips, -(-last // clips)):
        whole = pass_order(layout.shard_clips, order, source=source, number=number)
        parts.append(whole[max(first - number * clips, 0) : last - number * clips])
    return parts[1] if len(parts) == 2 else np.concatenate(parts)


def stretch_of_epoch(clips: int, weight: float, epoch: int) -> tuple[int, int]:
    """Where the stretch of an epoch begins and ends in the endless sequence of the passes over `clips` clips."""
    each = Fraction(repr(weight)) * clips  # the decimal that was written: ten tenths of it are one pass
    return round(epoch * each), round((epoch + 1) * each)


def _merge(parts: Sequence[Int64Array]) -> Int64Array:
    """Clip k of n of a source goes to place (k + 0.5) / n of the epoch; of equal places the first source's first."""
    places = np.concatenate([(np.arange(len(part)) + 0.5) / len(part) for part in parts if len(part)] or [np.empty(0)])
    return np.concatenate(parts)[np.argsort(places, kind="stable")]
