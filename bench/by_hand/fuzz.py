"""Damages sources at random and reads them: whatever comes of it must be a verdict or a `WsmError`, in bounded time.

Each case takes a small sound source of one reader, damages one to three of its files (bytes flipped, cut, zeroed,
lengthened, numbers and words of text replaced, files removed, renamed, exchanged, made folders), and runs every check
on it, as `wsm check` does. A case is told by its number alone. Run by hand, since it ends with its time:
`python bench/by_hand/fuzz.py tum --minutes 20`; `--only N` runs one case again. Readers: interndata (folders),
archive (interndata in archives), tum, lerobot2, lerobot3, arrays.
"""

import argparse
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from pipelines.operations.soundness.check_source import source_checks
from wsm_data.clips.soundness import SourceChecks, check_container
from wsm_data.errors import WsmError
from wsm_data.readers.registry import source_reader
from wsm_data.schema.dataset import CameraModel
from wsm_data.schema.source.motion import Motion
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.writers.scenes import write_scene

TESTS = Path(__file__).parents[2] / "tests" / "wsm_data"
sys.path += [str(TESTS / "fakes"), str(TESTS / "readers" / "lerobot")]

LONGEST_S = 120
MAX_MEMORY_BYTES = 8 << 30

Write = Callable[[Path], None]


def write_interndata(layout: str) -> Write:
    def write(out: Path) -> None:
        config = SynthConfig(
            scenes=1, trajectories=2, image_scale=0.1, min_frames=8, max_frames=14, max_step_m=0.3, layout=layout
        )
        write_scene(out, 0, "d435i", config)

    return write


def write_tum(out: Path) -> None:
    from hand_held import write_hand_held

    write_hand_held(out / "rgbd_dataset_home", frames=92)


def write_lerobot(version: int) -> Write:
    def write(out: Path) -> None:
        from conftest import make_walk
        from lerobot_set import write_set

        write_set(out, [make_walk(6, 0), make_walk(9, 1)], version=version)

    return write


def write_arrays(out: Path) -> None:
    from conftest import make_walk

    from wsm_data.readers.arrays import write_episode

    walk = make_walk(8, 0)
    frames = zip(walk.rgb, walk.depth_m, walk.T_world_camera, strict=True)
    K = np.array([[60.0, 0, 31.5], [0, 61.0, 23.5], [0, 0, 1]])
    write_episode(out, "scene", "one", frames, K=K, floor_z_m=0.0)


READERS: dict[str, tuple[Write, str]] = {
    "interndata": (write_interndata("scene_folder"), "synthetic"),
    "archive": (write_interndata("scene_archive"), "synthetic"),
    "tum": (write_tum, "tum_rgbd"),
    "lerobot2": (write_lerobot(2), "lerobot"),
    "lerobot3": (write_lerobot(3), "lerobot"),
    "arrays": (write_arrays, "arrays"),
}


def flip(data: bytearray, rng: np.random.Generator) -> None:
    for at in rng.integers(0, max(1, len(data)), size=int(rng.integers(1, 9))):
        if data:
            data[at] = int(rng.integers(256))


def cut(data: bytearray, rng: np.random.Generator) -> None:
    del data[int(rng.integers(0, len(data) + 1)) :]


def zero(data: bytearray, rng: np.random.Generator) -> None:
    start = int(rng.integers(0, len(data) + 1))
    stop = min(len(data), start + int(rng.integers(1, 4096)))
    data[start:stop] = bytes(stop - start)


def lengthen(data: bytearray, rng: np.random.Generator) -> None:
    data += rng.bytes(int(rng.integers(1, 4096)))


def replace_word(data: bytearray, rng: np.random.Generator) -> None:
    """Another number or word in place of one: nan, huge, negative, empty, a path out of the folder."""
    words = bytes(data[:20_000]).split()
    if words:
        old = words[int(rng.integers(len(words)))]
        new = (b"nan", b"1e308", b"-1", b"0", b"", b"../../x", b"\xff\xfe", b"999999999999999999999", b"null", b"[]")
        at = data.find(old)
        data[at : at + len(old)] = new[int(rng.integers(len(new)))]


CHANGES = (flip, cut, zero, lengthen, replace_word)


def damage(source: Path, rng: np.random.Generator) -> list[str]:
    """Damage one to three files, the small and rare ones as often as images, and say how."""
    said = []
    for _ in range(int(rng.integers(1, 4))):
        files = sorted(path for path in source.rglob("*") if path.is_file())
        if not files:
            break
        by_kind: dict[str, list[Path]] = {}
        for path in files:
            by_kind.setdefault(path.suffix or path.name, []).append(path)
        kind = sorted(by_kind)[int(rng.integers(len(by_kind)))]
        path = by_kind[kind][int(rng.integers(len(by_kind[kind])))]
        how = int(rng.integers(len(CHANGES) + 4))
        said.append(f"{path.relative_to(source)}: {_damage_file(path, files, how, rng)}")
    return said


def _damage_file(path: Path, files: list[Path], how: int, rng: np.random.Generator) -> str:
    if how < len(CHANGES):
        data = bytearray(path.read_bytes())
        CHANGES[how](data, rng)
        path.write_bytes(data)
        return CHANGES[how].__name__
    if how == len(CHANGES):
        path.unlink()
        return "removed"
    if how == len(CHANGES) + 1:
        path.rename(path.with_name(f"{path.stem} {rng.integers(100)}{path.suffix}"))
        return "renamed"
    if how == len(CHANGES) + 2:
        other = files[int(rng.integers(len(files)))]
        path.write_bytes(other.read_bytes() if other.is_file() else b"")
        return f"content of {other.name}"
    path.unlink()
    path.mkdir()
    return "a folder"


def checks_of(source: Path, dataset: str) -> SourceChecks:
    """As `wsm check` has them; what a LeRobot set does not say of its camera is given."""
    checks = source_checks(source, dataset)
    if dataset != "lerobot":
        return checks
    camera = CameraModel(width=64, height=48, fx=60.0, fy=61.0, cx=31.5, cy=23.5)
    manifest = replace(
        checks.dataset,
        features=replace(checks.dataset.features, depth="observation.images.depth"),
        motion=Motion(carried_by="hand", floor_z_m=0.0),
        cameras={"camera": camera},
    )
    return replace(checks, dataset=manifest)


def read_all(source: Path, dataset: str) -> str:
    """The first of the reasons that were told, or the kind of the error."""
    checks = checks_of(source, dataset)
    try:
        reader = source_reader(checks.dataset)
        reasons = {
            str(finding.reason)
            for container in reader.find_containers(source, checks.dataset)
            for unit in check_container(container, checks)
            for finding in unit.findings
        }
    except WsmError as error:
        return type(error).__name__
    return min(reasons, default="kept")


def timed_out(_signal: int, _frame: object) -> None:
    raise TimeoutError(f"longer than {LONGEST_S} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("reader", choices=READERS)
    parser.add_argument("--minutes", type=float, default=20)
    parser.add_argument("--only", type=int, help="run this case alone")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    signal.signal(signal.SIGALRM, timed_out)
    write, dataset = READERS[args.reader]
    told: Counter[str] = Counter()
    crashes = 0
    with tempfile.TemporaryDirectory() as folder:
        sound = Path(folder) / "sound"
        write(sound)
        print(f"{args.reader}, sound: {read_all(sound, dataset)}", flush=True)
        end = time.monotonic() + 60 * args.minutes
        case = args.only or 0
        while time.monotonic() < end:
            source = Path(folder) / "case"
            shutil.copytree(sound, source)
            said = damage(source, np.random.default_rng([case, len(args.reader)]))
            signal.alarm(LONGEST_S)
            try:
                told[read_all(source, dataset)] += 1
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                crashes += 1
                print(f"case {case}, {'; '.join(said)}\n{traceback.format_exc()}", flush=True)
            finally:
                signal.alarm(0)
            shutil.rmtree(source)
            case += 1
            if args.only is not None:
                break
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{args.reader}: {case - (args.only or 0)} cases, {crashes} crashes, {peak_mb:.0f} MB at most; {dict(told)}")


if __name__ == "__main__":
    main()
