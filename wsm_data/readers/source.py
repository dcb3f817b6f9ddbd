"""What a source must be able to do, whatever it looks like: list its containers, scan one, give its frames.

A reader is a `SourceReader` in `readers/registry.py`; a manifest names the one that reads its source. Programs know
these words and no other of a source. Two passes are made over a container: `scan` decides what of it can be used and
keeps records, a cloud and few images; `iter_frames` reads the images of the episodes that are wanted.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from wsm_data.schema.dataset import DatasetManifest
from wsm_data.schema.episode import EpisodeRecord
from wsm_data.schema.frames import DepthFrame, EpisodeFrames
from wsm_data.schema.point_cloud import PointCloud
from wsm_data.schema.verdict import Refusal

DepthSample = tuple[int, DepthFrame]
"""A frame's index in its episode, and its depth image."""


@dataclass(frozen=True, kw_only=True)
class Container:
    """One archive, folder or file of a source: what is read as a whole, and may hold several episodes of one scene.

    Attributes:
        id: its path relative to the source root, with `/`.
        layout: the reader's word for the form it is stored in.
        signature: digest of (relative name, size, mtime in ns) of all its files: the cheap test for "was anything
            touched"; it says nothing about content. A file that cannot be looked at counts with the system's error.
    """

    id: str
    layout: str
    signature: str


@dataclass(frozen=True, kw_only=True)
class ContainerScan:
    """What one pass over a container found.

    Attributes:
        records: the usable episodes, by id.
        refusals: one for each episode that is not, by id; the usable ones go on.
        cloud: the points of the scene, None where there is no cloud or it is damaged.
        cloud_refusal: why the cloud cannot be used, None where there is none or it is whole.
        depth_samples: episode text to every n-th depth image, for a map from depth; empty unless the container has
            no cloud at all.
        bytes_read: bytes of the files that were looked at.
    """

    records: tuple[EpisodeRecord, ...]
    refusals: tuple[Refusal, ...]
    cloud: PointCloud | None
    cloud_refusal: Refusal | None
    depth_samples: Mapping[str, tuple[DepthSample, ...]]
    bytes_read: int


@dataclass(frozen=True, kw_only=True)
class Preflight:
    """Whether a container came over whole; nothing in it was decoded.

    Attributes:
        unit: id of the container.
        walked: whether all of it was read; where not, only its first and last bytes were.
        bytes_read: of its files.
        trajectories: how many it seems to hold.
        refusals: what is wrong with it.
    """

    unit: str
    walked: bool
    bytes_read: int = 0
    trajectories: int = 0
    refusals: tuple[Refusal, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SourceReader:
    """A kind of source, as plain functions; each takes the source root and the conventions that apply to it.

    Attributes:
        name: the word a manifest names it by.
        expects: what a source of this kind looks like, for people and for messages about one that does not.
        find_containers: everything that is or should be a container, by id. Raises `ConfigError` where the root is no
            such source at all.
        scan: reads a container once, keeping every n-th depth image where it has no cloud; n is the last argument.
            Raises `DataError` where the container as a whole cannot be used.
        iter_frames: gives the wanted episodes of a container, each once and as soon as it is complete, in one pass and
            in the order that costs least. Raises `IntegrityError` where the images are not those that were scanned.
        preflight: says whether a container came over whole: all of it, or, where the last argument is false, as far as
            its first and last bytes tell. None: `scan` reads little more than that, and does it.
    """

    name: str
    expects: str
    find_containers: Callable[[Path, DatasetManifest], Sequence[Container]]
    scan: Callable[[Path, Container, DatasetManifest, int], ContainerScan]
    iter_frames: Callable[
        [Path, Container, DatasetManifest, Sequence[EpisodeRecord]], Iterator[tuple[EpisodeRecord, EpisodeFrames]]
    ]
    preflight: Callable[[Path, Container, DatasetManifest, bool], Preflight] | None = None
