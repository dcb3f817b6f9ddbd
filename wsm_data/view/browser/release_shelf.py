"""A release on its way to pages: its table, and whatever of a clip is looked at."""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from wsm_data.access.release import Release
from wsm_data.errors import ConfigError
from wsm_data.schema.clip import Clip
from wsm_data.shards.selection import Selection, selection_names
from wsm_data.view.browser.clip_page import clip_page, map_picture
from wsm_data.view.browser.clip_query import ClipQuery
from wsm_data.view.browser.clip_table import RANK, clip_table
from wsm_data.view.browser.kept import Kept
from wsm_data.view.clip.pictures import decode_pictures
from wsm_data.view.drawing.jpeg import jpeg, thumbnail

_KEPT_CLIPS = 3
_KEPT_THUMBNAILS = 3000
_KEPT_SELECTIONS = 4


@dataclass(frozen=True, kw_only=True)
class ShownClip:
    """A clip that somebody looks at.

    Attributes:
        clip: the clip.
        rgb: colour of each recorded frame, JPEG.
        depth: depth in colours of each, JPEG; empty where the clip has none.
    """

    clip: Clip
    rgb: tuple[bytes, ...]
    depth: tuple[bytes, ...]


class ReleaseShelf:
    """What pages ask of a release. No clip is read before it is looked at; methods may be called from many threads.

    All of them raise ConfigError where a name or key is not there, and IntegrityError where what is read is damaged.
    """

    def __init__(self, release: Release, weights: str = "") -> None:
        self.release = release
        self.table, self._notice = clip_table(release)
        self._weights = weights
        self._shown = Kept(self._show, _KEPT_CLIPS)
        self._clips = Kept(release.read_clip, _KEPT_CLIPS)
        self._thumbnails = Kept(self._thumbnail, _KEPT_THUMBNAILS)
        self._selections = Kept(release.selection, _KEPT_SELECTIONS)
        self._codec_lock = threading.Lock()
        self._warm = threading.Event()

    def about(self) -> dict[str, Any]:
        """What the release is, and what can be asked of its clips; JSON values."""
        manifest = self.release.manifest
        return {
            "name": manifest.name,
            "where": self.release.store.root,
            "clips": len(self.release),
            "frames": manifest.frames,
            "codec": manifest.codec.name,
            "aspect": [manifest.encoded_width_px, manifest.encoded_height_px],
            "splits": dict(manifest.clips_by_split),
            "columns": self.table.columns,
            "selections": selection_names(self.release.store),
            "notice": self._notice,
        }

    def clips(self, query: ClipQuery) -> dict[str, Any]:
        """One page of the clips that a query asks for, and how many there are; JSON values."""
        selection, rows = self._rows(query)
        page = rows[query.offset : query.offset + query.limit].tolist()
        records = self.table.records(page)
        if selection is not None:
            ranks = self.table.ranks(selection)
            for record, row in zip(records, page, strict=True):
                record |= {RANK: int(ranks[row]), "why": selection.why[int(ranks[row]) - 1].as_py()}
        return {"total": len(rows), "offset": query.offset, "clips": records}

    def around(self, key: str, query: ClipQuery) -> dict[str, Any]:
        """The clips before and after one among those that a query asks for; JSON values."""
        rows = self._rows(query)[1]
        places = np.flatnonzero(rows == int(self.release.index.rows_of([key])[0]))
        place = int(places[0]) if len(places) else None
        beside = [] if place is None else [place - 1, place + 1]
        keys = [self.table.keys[int(rows[one])].as_py() if 0 <= one < len(rows) else None for one in beside]
        previous, following = keys or (None, None)
        return {"place": place, "total": len(rows), "previous": previous, "next": following}

    def page(self, key: str) -> dict[str, Any]:
        """All that the page of a clip shows beside its pictures; JSON values."""
        row = int(self.release.index.rows_of([key])[0])
        clip = self._clips.get(key)  # refuses a key that is not there
        record = self.table.records([row])[0]
        scores = [
            {"name": name, "value": record[name], "unit": column.unit, "summary": column.summary, "hard": column.hard}
            for name, column in self.table.numbers.items()
            if column.summary and name not in ("frames", "padded_frames")
        ]
        texts = {name: record[name] for name in self.table.texts}
        return {**clip_page(clip), "texts": texts, "scores": scores}

    def map_png(self, key: str) -> bytes:
        """The map of a clip; PNG."""
        return map_picture(self._clips.get(key))

    def thumbnail(self, key: str) -> bytes:
        """The first frame of a clip, small; JPEG."""
        return self._thumbnails.get(key)

    def frame(self, key: str, kind: str, number: int) -> bytes:
        """A frame of a clip, `rgb` or `depth`; JPEG. All frames are decoded when the first is asked for."""
        shown = self._shown.get(key)
        pictures: Mapping[str, tuple[bytes, ...]] = {"rgb": shown.rgb, "depth": shown.depth}
        if kind not in pictures or number >= len(pictures[kind]):
            raise ConfigError(f"{key} has no {kind} frame {number}; it has {len(shown.rgb)} frames, from 0")
        return pictures[kind][number]

    def warm_up(self) -> None:
        """Decode zeros once, so that the kernels are compiled when a clip is looked at; again, it does nothing."""
        if self._warm.is_set():
            return
        self._warm.set()
        manifest = self.release.manifest
        shape = (2, manifest.codec.channels, manifest.encoded_height_px // 16, manifest.encoded_width_px // 16)
        try:
            with self._codec_lock:
                self.release.codec(self._weights).decode(np.zeros(shape, np.float32))
        except ConfigError:  # whoever looks at a clip is told
            return

    def _rows(self, query: ClipQuery) -> tuple[Selection | None, np.ndarray]:
        selection = self._selections.get(query.selection) if query.selection else None
        return selection, self.table.rows(query, selection)

    def _show(self, key: str) -> ShownClip:
        clip = self._clips.get(key)
        with self._codec_lock:
            codec = self.release.codec(self._weights)
            pictures = decode_pictures(clip, codec, range(clip.meta.recorded_frames))
        depth = tuple(map(jpeg, pictures.depth_u8)) if clip.has_depth else ()
        return ShownClip(clip=clip, rgb=tuple(map(jpeg, pictures.rgb_u8)), depth=depth)

    def _thumbnail(self, key: str) -> bytes:
        with self._codec_lock:
            return thumbnail(self.release.decode(key, frames=(0,), weights=self._weights).rgb[0])
