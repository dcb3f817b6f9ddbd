"""Two releases side by side: what they are, and which clips one of them lacks, or has otherwise."""

from functools import cached_property
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from wsm_data.access.release import Release
from wsm_data.errors import ConfigError
from wsm_data.files.arrow_arrays import numpy_of

LEFT, RIGHT, CHANGED, SAME = "left", "right", "changed", "same"
WHERE = (CHANGED, LEFT, RIGHT, SAME)
"""Only in the left or right release; in both, of another trajectory, split or length; in both alike."""

_COMPARED = ("source_digest", "split", "frames")


class Comparison:
    """The clips of two releases by key."""

    def __init__(self, left: Release, right: Release) -> None:
        self._left, self._right = left, right

    def about(self) -> dict[str, Any]:
        """Both releases in numbers, and how many clips are where; JSON values."""
        counts = {name: len(keys) for name, keys in self._keys.items()}
        return {"releases": [_facts(self._left), _facts(self._right)], "counts": counts}

    def listed(self, where: str, text: str, offset: int, limit: int) -> dict[str, Any]:
        """Some keys of the clips that are in one release, in both alike, or in both and changed; JSON values.

        Raises:
            ConfigError: `where` is none of `WHERE`.
        """
        if where not in self._keys:
            raise ConfigError(f"where must be one of {', '.join(WHERE)}, found {where!r}")
        keys = self._keys[where]
        if text:
            keys = keys.filter(pc.match_substring(keys, text, ignore_case=True))
        shown = keys.slice(offset, limit).to_pylist()
        return {"total": len(keys), "clips": [{"key": key, "changed": self._changes(key, where)} for key in shown]}

    def _changes(self, key: str, where: str) -> list[str]:
        """What is not the same of a clip that both have."""
        if where != CHANGED:
            return []
        left, right = self._left.index.row(key), self._right.index.row(key)
        pairs = {"split": (left.split, right.split), "frames": (left.frames, right.frames)}
        said = [f"{name}: {one} → {other}" for name, (one, other) in pairs.items() if one != other]
        return said + (["another trajectory"] if left.source_digest != right.source_digest else [])

    @cached_property
    def _keys(self) -> dict[str, pa.StringArray]:
        """Keys by where they are, sorted."""
        left, right = (one.index.columns(["key", *_COMPARED]) for one in (self._left, self._right))
        places = self._right.index.rows_of(left["key"].combine_chunks())
        both = np.flatnonzero(places >= 0)
        same = np.ones(len(both), np.bool_)
        for name in _COMPARED:
            one, other = (table[name].cast(pa.string()) for table in (left.take(both), right.take(places[both])))
            same &= numpy_of(pc.equal(one, other)).astype(np.bool_)
        only_right = np.setdiff1d(np.arange(len(right)), places[both])
        rows = {LEFT: (left, np.flatnonzero(places < 0)), RIGHT: (right, only_right)}
        rows |= {CHANGED: (left, both[~same]), SAME: (left, both[same])}
        return {name: _sorted(table["key"].take(pa.array(chosen))) for name, (table, chosen) in rows.items()}


def _sorted(keys: pa.ChunkedArray) -> pa.StringArray:
    whole = keys.combine_chunks()
    return whole.take(pc.sort_indices(whole))


def _facts(release: Release) -> dict[str, Any]:
    manifest = release.manifest
    facts = {
        "clips": f"{len(release):,}",
        **{f"clips, {split}": f"{count:,}" for split, count in sorted(manifest.clips_by_split.items())},
        "frames": f"{manifest.frames:,}",
        "codec": f"{manifest.codec.name} {manifest.codec.digest[:12]}",
        "image": f"{manifest.encoded_width_px} x {manifest.encoded_height_px} px",
        "refused": f"{sum(manifest.drops.values()):,}",
        "release digest": release.digest[:12],
    }
    return {"name": manifest.name, "where": release.store.root, "facts": list(facts.items())}
