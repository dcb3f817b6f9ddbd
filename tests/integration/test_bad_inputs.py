"""One tree with everything that goes wrong in the wild: each refused by its code, the rest unharmed, nothing lost."""

import io
import json
import shutil
import tarfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipelines.running.ledger import read_ledger
from wsm_data.access.release import open_release
from wsm_data.access.verify import verify_release
from wsm_data.errors import BudgetExceeded, ConfigError
from wsm_data.files.jsonlines import read_lines
from wsm_data.shards.inventory import UnitState

GROUP = "synth_d435i"
POINT = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
Damage = Callable[[Path], None]


def _frame(scene: Path, kind: str, episode: int, frame: int) -> Path:
    (path,) = scene.glob(f"videos/chunk-000/observation.images.{kind}/episode_{episode:06d}_{frame:03d}.*")
    return path


def _frames(scene: Path, kind: str, episode: int) -> list[Path]:
    return sorted(scene.glob(f"videos/chunk-000/observation.images.{kind}/episode_{episode:06d}_*"))


def _table(scene: Path, episode: int = 0) -> Path:
    return scene / "data" / "chunk-000" / f"episode_{episode:06d}.parquet"


def _rewrite_table(scene: Path, change: Callable[[dict[str, list[object]]], object]) -> None:
    path = _table(scene)
    columns = pq.read_table(path).to_pydict()
    change(columns)
    pq.write_table(pa.table(columns), path)


def _copy_under_another_name(good: Path, scene: Path) -> None:
    """A copy whose pictures are the same and whose files are not: a comment with its name stands in their JPEGs."""
    shutil.copytree(good, scene)
    comment = scene.name.encode()
    for episode in (0, 1):
        path = _frames(scene, "rgb", episode)[0]
        image = path.read_bytes()
        path.write_bytes(image[:2] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + image[2:])


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _eight_bit(path: Path) -> None:
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(path), (image >> 8).astype(np.uint8))


def _keep_frames(scene: Path, count: int) -> None:
    _rewrite_table(scene, lambda columns: [columns.update({name: values[:count]}) for name, values in columns.items()])
    for kind in ("rgb", "depth"):
        for path in _frames(scene, kind, 0)[count:]:
            path.unlink()


def _set_pose(columns: dict[str, list[object]], frame: int, entry: tuple[int, int], value: float) -> None:
    pose = np.array(columns["action"][frame], np.float32).reshape(4, 4)
    pose[entry] = value
    columns["action"][frame] = pose.tolist()


def _wrong_intrinsics(columns: dict[str, list[object]]) -> None:
    K = np.array(columns["observation.camera_intrinsic"][0], np.float32).reshape(3, 3)
    K[:2] *= 4  # of another image size
    columns["observation.camera_intrinsic"] = [K.tolist()] * len(columns["action"])


def _double_length(scene: Path) -> None:
    path = scene / "meta" / "episodes.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    for line in lines:
        line["length"] *= 2
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))


def _cloud(scene: Path) -> Path:
    return scene / "meta" / "pointcloud.ply"


def _split_ply(path: Path) -> tuple[bytes, bytes]:
    head, end, body = path.read_bytes().partition(b"end_header\n")
    return head + end, body


def _grey_cloud(scene: Path) -> None:
    head, body = _split_ply(_cloud(scene))
    points = np.frombuffer(body, POINT).copy()
    points["rgb"] = 128
    _cloud(scene).write_bytes(head + points.tobytes())


def _huge_cloud(scene: Path) -> None:
    head, body = _split_ply(_cloud(scene))
    lines = [b"element vertex 999999999999" if b"element vertex" in line else line for line in head.split(b"\n")]
    _cloud(scene).write_bytes(b"\n".join(lines) + body)


def _empty_cloud(scene: Path) -> None:
    head, _ = _split_ply(_cloud(scene))
    lines = [b"element vertex 0" if b"element vertex" in line else line for line in head.split(b"\n")]
    _cloud(scene).write_bytes(b"\n".join(lines))


def _path_xy_m(scene: Path) -> np.ndarray:
    actions = pq.read_table(_table(scene)).to_pydict()["action"]
    return np.array(actions, np.float32).reshape(-1, 4, 4)[:, :2, 3]


def _add_obstacles(scene: Path, xy_m: np.ndarray) -> None:
    """Add obstacle points to the cloud, at two heights near the floor."""
    head, body = _split_ply(_cloud(scene))
    old = len(body) // POINT.itemsize
    added = np.zeros(2 * len(xy_m), POINT)
    added["xyz"][:, :2] = np.concatenate([xy_m, xy_m])
    added["xyz"][:, 2] = np.repeat([0.17, 0.22], len(xy_m))
    added["rgb"] = (0, 0, 128)
    head = head.replace(f"element vertex {old}".encode(), f"element vertex {old + len(added)}".encode())
    _cloud(scene).write_bytes(head + body + added.tobytes())


def _pillar_on_the_path(scene: Path) -> None:
    angle = np.linspace(0, 2 * np.pi, 60)
    _add_obstacles(scene, _path_xy_m(scene)[5] + 0.04 * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _ring_around_the_goal(scene: Path) -> None:
    """Close the goal off but for a gap of 0.36 m where the path enters: nothing is touched, but 0.5 m is needed."""
    path = _path_xy_m(scene)
    dense = np.concatenate([a + np.linspace(0, 1, 50)[:, None] * (b - a) for a, b in pairwise(path)])
    angle = np.linspace(0, 2 * np.pi, 2000)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.concatenate([path[-1] + radius * circle for radius in (0.8, 0.84, 0.88)])
    away = np.linalg.norm(ring[:, None] - dense[None], axis=2).min(axis=1)
    _add_obstacles(scene, ring[away > 0.18])


TRAJECTORY_DAMAGES: dict[str, tuple[Damage, str]] = {
    "zero_byte_rgb": (lambda scene: _frame(scene, "rgb", 0, 3).write_bytes(b""), "frame.empty"),
    "zero_byte_depth": (lambda scene: _frame(scene, "depth", 0, 3).write_bytes(b""), "frame.empty"),
    "truncated_rgb": (lambda scene: _cut(_frame(scene, "rgb", 0, 4)), "frame.truncated"),
    "truncated_depth": (lambda scene: _cut(_frame(scene, "depth", 0, 4)), "frame.truncated"),
    "eight_bit_depth": (lambda scene: _eight_bit(_frame(scene, "depth", 0, 5)), "depth.not_16_bit"),
    "one_depth_less": (lambda scene: _frames(scene, "depth", 0)[-1].unlink(), "frame.count_mismatch"),
    "frame_missing": (
        lambda scene: [_frame(scene, kind, 0, 6).unlink() for kind in ("rgb", "depth")],
        "frame.missing",
    ),
    "table_unreadable": (lambda scene: _table(scene).write_bytes(b"PAR1 nonsense PAR1"), "table.unreadable"),
    "table_without_column": (
        lambda scene: _rewrite_table(scene, lambda columns: columns.pop("action")),
        "table.missing_column",
    ),
    "table_with_nan": (
        lambda scene: _rewrite_table(scene, lambda columns: _set_pose(columns, 2, (0, 3), float("nan"))),
        "pose.not_finite",
    ),
    "pose_not_rigid": (
        lambda scene: _rewrite_table(scene, lambda columns: _set_pose(columns, 2, (0, 0), 2.0)),
        "pose.not_rigid",
    ),
    "fewer_rows": (
        lambda scene: _rewrite_table(
            scene, lambda columns: [columns.update({name: values[:-1]}) for name, values in columns.items()]
        ),
        "table.row_count",
    ),
    "wrong_intrinsics": (lambda scene: _rewrite_table(scene, _wrong_intrinsics), "intrinsics.misfit"),
    "too_short": (lambda scene: _keep_frames(scene, 4), "episode.too_short"),
    "through_an_obstacle": (_pillar_on_the_path, "path.through_obstacle"),
    "goal_closed_off": (_ring_around_the_goal, "goal.unreachable"),
}

MAP_DAMAGES = ("through_an_obstacle", "goal_closed_off")
"""Damages of the map all trajectories share: the other one may be refused with the first."""

CLOUD_DAMAGES: dict[str, tuple[Damage, str]] = {
    "cloud_empty": (_empty_cloud, "cloud.empty"),
    "cloud_without_obstacles": (_grey_cloud, "cloud.no_obstacles"),
    "cloud_with_huge_header": (_huge_cloud, "cloud.header"),
}


def _archive(scene: Path, path: Path, extra: tarfile.TarInfo | None = None) -> None:
    with tarfile.open(path, "w:gz", compresslevel=1) as archive:
        archive.add(scene, arcname=scene.name)
        if extra is not None:
            archive.addfile(extra, io.BytesIO(b"x" * extra.size))


def _member(name: str, kind: bytes = tarfile.REGTYPE, target: str = "") -> tarfile.TarInfo:
    member = tarfile.TarInfo(name)
    member.type, member.linkname = kind, target
    member.size = 1 if kind == tarfile.REGTYPE else 0
    return member


def _write_archives(scene: Path, group: Path) -> dict[str, str]:
    """Damaged archives of a good scene in `group`; returns the reason expected of each file."""
    name = scene.name
    unsafe = {
        "dotdot": _member(f"{name}/../../evil"),
        "absolute": _member("/evil"),
        "symlink": _member(f"{name}/link", tarfile.SYMTYPE, "/etc/passwd"),
        "hardlink": _member(f"{name}/hard", tarfile.LNKTYPE, "../evil"),
    }
    for kind, member in unsafe.items():
        _archive(scene, group / f"{kind}.tar.gz", member)
    _archive(scene, group / "truncated.tar.gz")
    _cut(group / "truncated.tar.gz")
    (group / "pointer.tar.gz").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")
    (group / "not_gzip.tar.gz").write_bytes(b"PK\x03\x04 this is a zip file, or was")
    return {
        **{f"{GROUP}/{kind}.tar.gz": "archive.unsafe_member" for kind in unsafe},
        f"{GROUP}/truncated.tar.gz": "archive.truncated",
        f"{GROUP}/pointer.tar.gz": "archive.pointer_file",
        f"{GROUP}/not_gzip.tar.gz": "archive.not_gzip",
    }


@pytest.fixture(scope="module")
def damaged(make_source, run_pipeline, tmp_path_factory):
    """The run folder over a tree of damages, and what must be refused: unit id to reason code."""
    root = tmp_path_factory.mktemp("damaged")
    good = make_source(layout="scene_folder", cameras=("d435i",)) / GROUP / "home_0001"
    group = root / "source" / GROUP
    group.mkdir(parents=True)
    expected = {}
    for name, (damage, reason) in {**TRAJECTORY_DAMAGES, **CLOUD_DAMAGES}.items():
        _copy_under_another_name(good, group / name)
        damage(group / name)
        episodes = ("000000",) if name in TRAJECTORY_DAMAGES else ("000000", "000001")
        expected.update({f"{GROUP}/{name}/{episode}": reason for episode in episodes})
    shutil.copytree(good, group / "home_0001")
    for name in ("length_doubled", "without_cloud"):
        _copy_under_another_name(good, group / name)
    shutil.copytree(good, group / "home_0001 (1)")  # as browsers name a second download
    expected.update({f"{GROUP}/home_0001 (1)/{number}": "episode.same_content" for number in ("000000", "000001")})
    _double_length(group / "length_doubled")
    _cloud(group / "without_cloud").unlink()
    expected.update(_write_archives(good, group))
    _archive(good, group / "home_0001.tar.gz")  # the same scene again: its trajectories are there twice
    (group / "hollow").mkdir()
    expected[f"{GROUP}/hollow"] = "container.no_episodes"
    run_pipeline(root / "source", root / "run")
    return root / "run", expected


def _quarantine(run: Path) -> dict[str, str]:
    return {
        line["unit"]: line["reason"]
        for stage in ("index", "encode")
        for line in read_lines(run / stage / "quarantine.jsonl")
    }


def test_every_damage_is_refused_under_its_own_code_and_nothing_else_is(damaged):
    run, expected = damaged
    found = _quarantine(run)
    duplicates = {unit for unit, reason in found.items() if reason == "episode.duplicate"}
    shared = {f"{GROUP}/{name}/000001" for name in MAP_DAMAGES}
    assert {unit: found[unit] for unit in found if unit not in duplicates | shared} == expected
    assert len(duplicates) == 2


def test_what_was_not_damaged_becomes_a_clip(damaged):
    run, _ = damaged
    clips = set(open_release(run / "pack" / "release").index.texts("key"))
    wanted = {f"{GROUP}/{name}/000001" for name in TRAJECTORY_DAMAGES if name not in MAP_DAMAGES}
    wanted |= {f"{GROUP}/{name}/00000{n}" for name in ("home_0001", "length_doubled", "without_cloud") for n in (0, 1)}
    assert wanted <= clips


def test_a_doubled_length_and_a_missing_cloud_are_noted_in_the_clips(damaged):
    release = open_release(damaged[0] / "pack" / "release")
    assert release.read_clip(f"{GROUP}/length_doubled/000000").meta.notes == ("episode.length_mismatch",)
    without = release.read_clip(f"{GROUP}/without_cloud/000000").meta
    assert without.notes == ("cloud.missing",)
    assert without.map_from == "depth"


def test_what_went_in_came_out_once(damaged):
    run, expected = damaged
    assert verify_release(run / "pack" / "release") == []
    inventory = open_release(run / "pack" / "release").inventory
    own = [row for row in inventory if row.reason != "episode.duplicate"]
    states = {row.unit: row.state for row in own}
    assert len(states) == len(own) == len(inventory) - 2
    assert {unit for unit, state in states.items() if state == UnitState.REFUSED} >= set(expected)
    assert UnitState.PENDING not in states.values()


def test_every_refusal_says_what_where_and_how_much(damaged):
    for stage in ("index", "map", "encode"):
        for line in read_lines(damaged[0] / stage / "quarantine.jsonl"):
            assert set(line) == {
                "unit", "source", "stage", "stage_version", "fingerprint", "reason", "message", "details", "time",
            }  # fmt: skip
            assert line["stage"] == stage
            assert len(str(line["message"])) > 30


def test_an_archive_never_writes_outside_its_folder(damaged):
    run, _ = damaged
    assert not list(run.parent.rglob("evil"))
    assert not Path("/evil").exists()


def test_a_scene_without_a_cloud_can_be_refused_instead(make_source, run_pipeline, tmp_path):
    source = tmp_path / "source"
    shutil.copytree(make_source(layout="scene_folder"), source)
    _cloud(source / GROUP / "home_0001").unlink()
    run_pipeline(source, tmp_path / "run", settings={"map": {"without_cloud": "refuse"}})
    reasons = _quarantine(tmp_path / "run")
    assert reasons == {f"{GROUP}/home_0001/00000{number}": "cloud.missing" for number in (0, 1)}


def test_more_refusals_than_allowed_stop_the_stage_and_a_higher_budget_goes_on(make_source, run_pipeline, tmp_path):
    source = tmp_path / "source"
    shutil.copytree(make_source(layout="scene_archive"), source)
    _cut(source / GROUP / "home_0001.tar.gz")
    with pytest.raises(BudgetExceeded, match="1 of 2 units were refused"):
        run_pipeline(source, tmp_path / "run", max_refused=0.1)
    done = {unit for unit, entry in read_ledger(tmp_path / "run" / "index").items() if entry.outcome.state == "done"}
    reports = run_pipeline(source, tmp_path / "run", max_refused=0.5)
    assert done.isdisjoint(reports["index"].ran)
    assert open_release(tmp_path / "run" / "pack" / "release").manifest.drops == {"archive.truncated": 1}


def test_an_empty_or_absent_source_is_a_wrong_request(run_pipeline, tmp_path):
    (tmp_path / "empty").mkdir()
    for source in (tmp_path / "empty", tmp_path / "absent"):
        with pytest.raises(ConfigError, match="source"):
            run_pipeline(source, tmp_path / "run")
