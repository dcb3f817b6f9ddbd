"""Guards that need the index alone: scenes that two splits share, and content that is there twice."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np
import pyarrow as pa

from wsm_data.curation.audit.finding import AuditFinding, Check, Severity
from wsm_data.curation.split import SplitBy

CONTENT_COLUMNS = (
    "key",
    "split",
    "physical_scene",
    "camera",
    "source_digest",
    "rgb_latent_checksum",
    "depth_latent_checksum",
    "poses_checksum",
)
"""Columns of the index that these guards read."""

_SHOWN_CLIPS = 3


def scenes_in_several_splits(index: pa.Table, promised: SplitBy) -> Iterator[AuditFinding]:
    """Physical scenes with clips in more than one split, under any camera.

    Args:
        index: the columns `CONTENT_COLUMNS`.
        promised: how the splits were dealt: scenes are shared by design when trajectories were (paper, section 4.1),
            and must not be when scenes were.
    """
    severity = Severity.ERROR if promised is SplitBy.SCENE else Severity.INFO
    clips: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    columns = (index[name].to_pylist() for name in ("physical_scene", "split", "key"))
    for scene, split, key in zip(*columns, strict=True):
        clips[scene][split].append(key)
    for scene, by_split in sorted(clips.items()):
        if len(by_split) > 1:
            counts = ", ".join(f"{len(keys)} in {split}" for split, keys in sorted(by_split.items()))
            shown = tuple(sorted(key for keys in by_split.values() for key in sorted(keys)[:_SHOWN_CLIPS]))
            message = f"scene {scene} has clips in several splits: {counts}"
            yield AuditFinding(check=Check.SCENE_IN_SPLITS, severity=severity, clips=shown, message=message)


def repeated_content(index: pa.Table) -> Iterator[AuditFinding]:
    """Clips of the same trajectory under several ids: by the digest of the source, or by latents and poses.

    The digest of a source is over its stored frames; latents and poses are equal too where the same pictures were
    stored in other files. Across splits that is an error: what is tested on was trained on.

    Args:
        index: the columns `CONTENT_COLUMNS`.
    """
    by_source = _same(index, ["source_digest"])
    by_members = _same(index, ["rgb_latent_checksum", "depth_latent_checksum", "poses_checksum"])
    known = {tuple(group) for group in by_source}
    for groups, what in ((by_source, "source digest"), (by_members, "latents and poses")):
        for group in groups:
            if what == "source digest" or tuple(group) not in known:
                yield _repeated(index.take(pa.array(group)), what)


def _repeated(clips: pa.Table, what: str) -> AuditFinding:
    keys, splits = clips["key"].to_pylist(), sorted(set(clips["split"].to_pylist()))
    across = f", in the splits {' and '.join(splits)}" if len(splits) > 1 else f", in {splits[0]}"
    return AuditFinding(
        check=Check.CONTENT_TWICE,
        severity=Severity.ERROR if len(splits) > 1 else Severity.WARNING,
        clips=tuple(sorted(keys)),
        message=f"{len(keys)} clips have the same {what}{across}",
    )


def _same(index: pa.Table, columns: Sequence[str]) -> list[list[int]]:
    """Rows that are equal in all the columns, where more than one is, in the order of their first row."""
    codes = [
        np.asarray(index[name].dictionary_encode().unify_dictionaries().combine_chunks().indices) for name in columns
    ]
    _, group, counts = np.unique(np.stack(codes), axis=1, return_inverse=True, return_counts=True)
    rows = np.flatnonzero(counts[group.ravel()] > 1)
    found: dict[int, list[int]] = defaultdict(list)
    for row, number in zip(rows.tolist(), group.ravel()[rows].tolist(), strict=True):
        found[number].append(row)
    return sorted(found.values())
