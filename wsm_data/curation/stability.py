"""How much of a selection is the same in another one, and how much of it hangs on which clips there happened to be."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from wsm_data.curation.choose import PathReader
from wsm_data.curation.path_outline import Outlines
from wsm_data.curation.scores_table import ScoreTable
from wsm_data.curation.select import SelectionConfig, select_clips
from wsm_data.errors import ConfigError


def jaccard(a: NDArray[np.int64], b: NDArray[np.int64]) -> float:
    """Clips that are in both over clips that are in either; 1 where both are empty."""
    either = len(np.union1d(a, b))
    return len(np.intersect1d(a, b)) / either if either else 1.0


@dataclass(frozen=True, kw_only=True)
class BootstrapOverlap:
    """What the same rule chose of samples of the clips.

    Attributes:
        jaccard: overlap of each sample's choice with what was chosen of the whole, among the clips of the sample.
        unmet: samples in which the quotas could not be met.
    """

    jaccard: tuple[float, ...]
    unmet: int


def bootstrap_overlap(
    index: pa.Table,
    scores: ScoreTable,
    read_paths: PathReader,
    config: SelectionConfig,
    chosen: NDArray[np.int64],
    *,
    samples: int = 20,
    seed: int = 0,
) -> BootstrapOverlap:
    """Select again from bootstrap samples of the split.

    Each sample draws as many clips as there are, with replacement; the clips that were drawn at all, 63 % on average,
    are selected from by the same settings.

    Args:
        index: the columns `INDEX_COLUMNS` of the release's index.
        scores: scores of the same clips in the same order.
        read_paths: from rows of the index to the outlines of their paths.
        config: how was selected.
        chosen: rows that were chosen of the whole; int64 [n].
        samples: how many samples.
        seed: another seed, other samples.
    """
    split = np.flatnonzero(np.asarray(index["split"].to_numpy() == config.split))
    overlaps, unmet = [], 0
    for sample in range(samples):
        drawn = _drawn(split, seed, sample)
        of_drawn = partial(_paths_of, read_paths, drawn)
        try:
            again = select_clips(index.take(pa.array(drawn)), _rows(scores, drawn), of_drawn, config)
        except ConfigError:
            unmet += 1
            continue
        overlaps.append(jaccard(drawn[again.rows], np.intersect1d(chosen, drawn)))
    return BootstrapOverlap(jaccard=tuple(overlaps), unmet=unmet)


def _rows(scores: ScoreTable, rows: NDArray[np.int64]) -> ScoreTable:
    columns = {name: values[rows] for name, values in scores.columns.items()}
    return replace(scores, keys=scores.keys.take(pa.array(rows)), columns=columns)


def _drawn(rows: NDArray[np.int64], seed: int, sample: int) -> NDArray[np.int64]:
    """The rows that a bootstrap sample holds, ascending; from raw bits, which are the same in every numpy."""
    raw = np.random.Philox(key=[seed, sample]).random_raw(len(rows))
    return rows[np.unique(raw % np.uint64(len(rows))).astype(np.int64)]


def _paths_of(read_paths: PathReader, rows: NDArray[np.int64], numbers: NDArray[np.int64]) -> Outlines:
    return read_paths(rows[numbers])
