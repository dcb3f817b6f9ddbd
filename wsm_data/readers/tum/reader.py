"""Sequences in the layout of TUM's RGB-D benchmark, and those that differ from it in names, scale and axes."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from wsm_data.readers.recorded import iter_recorded
from wsm_data.readers.source import Container, SourceReader
from wsm_data.readers.tum.scan import scan_sequence
from wsm_data.readers.tum.sequences import EXPECTS, find_containers, folder_of
from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import EpisodeFrames


def _iter_frames(
    source: Path, container: Container, dataset: DatasetManifest, records: Sequence[EpisodeRecord]
) -> Iterator[tuple[EpisodeRecord, EpisodeFrames]]:
    del dataset  # files are given as they are stored
    return iter_recorded(folder_of(source, container), records)


TUM = SourceReader(
    name="tum", expects=EXPECTS, find_containers=find_containers, scan=scan_sequence, iter_frames=_iter_frames
)
