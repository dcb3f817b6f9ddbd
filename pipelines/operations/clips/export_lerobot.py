"""`wsm export lerobot`: clips of a release as a LeRobot data set."""

import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import typer

from wsm_data.access.release import Release, open_release
from wsm_data.clips.lerobot.writer import LerobotWriter
from wsm_data.errors import ConfigError
from wsm_data.files.atomic import TEMPORARY_SUFFIX, flush_folder
from wsm_data.readers.lerobot.depth_codes import DepthQuantisation
from wsm_data.readers.lerobot.video import import_av
from wsm_data.schema.depth import DepthRange

_LEROBOT_MIN_M, _LEROBOT_MAX_M, _LEROBOT_SHIFT_M = 0.01, 10.0, 3.5


def export_lerobot(location: str, out: Path, split: str, limit: int, weights: str) -> None:
    """Write the first `limit` clips (0: all), split by split, as one data set; `out` appears when it is whole.

    Raises:
        ConfigError: there is no such release or split, PyAV is not installed, the codec cannot be built, some of the
            clips have depth and others not, or `out` is there and not empty.
    """
    release = open_release(location)
    import_av()
    keys = {one: release.keys(split=one) for one in ([split] if split else sorted(release.index.counts("split")))}
    chosen = dict(_first(keys, limit))
    has_depth = _has_depth(release, [key for some in chosen.values() for key in some])
    manifest = release.manifest
    size = (manifest.encoded_width_px, manifest.encoded_height_px)
    with _new_folder(out) as folder:
        writer = LerobotWriter(
            folder, size=size, quantisation=_quantisation(manifest.depth_range) if has_depth else None
        )
        try:
            for key in (key for some in chosen.values() for key in some):
                clip = release.read_clip(key)
                writer.add(clip, release.decode(clip, frames=range(clip.meta.recorded_frames), weights=weights))
            writer.finish({name: len(some) for name, some in chosen.items()})
        except BaseException:
            writer.abandon()
            raise
    count, total = (sum(map(len, one.values())) for one in (chosen, keys))
    typer.echo(f"{count} of {total} clips: {out}")


def _first(keys: dict[str, list[str]], limit: int) -> Iterator[tuple[str, list[str]]]:
    """The first `limit` keys (0: all) of the splits one after the other, without the splits of which none is left."""
    left = limit or sum(map(len, keys.values()))
    for name, some in keys.items():
        if left:
            yield name, some[:left]
            left -= len(some[:left])


def _has_depth(release: Release, keys: Sequence[str]) -> bool:
    """Whether the clips have depth: every episode of a data set has the same features."""
    wanted = np.isin(release.index.texts("key"), keys)
    [sizes] = release.index.values(["depth_latent_size"], np.flatnonzero(wanted))
    with_depth = int(np.count_nonzero(np.array(sizes)))
    if 0 < with_depth < len(keys):
        raise ConfigError(
            f"the episodes of a LeRobot data set must have depth all or none, and {with_depth} of {len(keys)} clips of "
            f"{release.manifest.name} have it; select those of one kind and materialise them first"
        )
    return with_depth > 0


def _quantisation(depth_range: DepthRange) -> DepthQuantisation:
    """LeRobot's own, widened where the release sees nearer or farther: its ends mean that nothing was measured."""
    return DepthQuantisation(
        depth_min=min(_LEROBOT_MIN_M, depth_range.min_m / 2),
        depth_max=max(_LEROBOT_MAX_M, depth_range.max_m * 2),
        shift=_LEROBOT_SHIFT_M,
        use_log=True,
    )


@contextmanager
def _new_folder(out: Path) -> Iterator[Path]:
    """A folder beside `out` that takes its name when all is written, and is removed when something fails."""
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise ConfigError(
            f"{out} must not be there, or be an empty folder: a data set is written whole; use another --out"
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(prefix=f".{out.name}.", suffix=TEMPORARY_SUFFIX, dir=out.parent))
    try:
        yield temporary
        temporary.chmod(0o755)
        temporary.replace(out)
        flush_folder(out.parent)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)  # there is none once it has been renamed
