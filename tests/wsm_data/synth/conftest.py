"""One home for all tests, and meshes made of bare triangles."""

from collections.abc import Callable

import numpy as np
import pytest

from wsm_data.synth.config import SynthConfig
from wsm_data.synth.drive.occupancy import SceneColumns, clearance, scene_columns
from wsm_data.synth.home.floor_plan import FloorPlan, Opening, Room
from wsm_data.synth.home.home import Home, make_home
from wsm_data.synth.home.style import Style, choose_style
from wsm_data.synth.render.render import RenderMesh
from wsm_data.synth.writers import recording


@pytest.fixture(scope="session")
def home() -> Home:
    return make_home(0, 0)


@pytest.fixture(scope="session")
def columns(home: Home) -> SceneColumns:
    return scene_columns(home)


@pytest.fixture(scope="session")
def standpoints(home: Home, columns: SceneColumns) -> list[tuple[float, float]]:
    """The place in each room that is farthest from everything up to 1.9 m; a camera may stand there."""
    room_for = clearance(columns, 1.9, SynthConfig())
    centres = room_for.centres(np.arange(room_for.distance_m.size))
    places = []
    for room in home.floor_plan.rooms:
        x, y = centres.T
        inside = (x > room.x0) & (x < room.x1) & (y > room.y0) & (y < room.y1)
        best = centres[np.where(inside, room_for.distance_m.ravel(), -1.0).argmax()]
        places.append((float(best[0]), float(best[1])))
    return places


@pytest.fixture
def known_home(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets recordings of seed 0, scene 0 use the home that was built once; that homes are the same is tested apart."""
    monkeypatch.setattr(recording, "make_home", lambda seed, scene, _clearance_m: {(0, 0): home}[seed, scene])


@pytest.fixture(scope="session")
def style() -> Style:
    return choose_style(np.random.default_rng(1))


@pytest.fixture(scope="session")
def small() -> SynthConfig:
    """A source that is written in a second: two short trajectories of small images."""
    return SynthConfig(
        scenes=1, trajectories=2, image_scale=0.25, min_frames=8, max_frames=30, min_step_m=0.1, max_step_m=0.4
    )


@pytest.fixture(scope="session")
def two_rooms() -> FloorPlan:
    """A hall of 4 m by 2 m, a bedroom of 4 m by 3 m north of it, a door between them and one window."""
    return FloorPlan(
        rooms=(Room(kind="hall", x0=0, y0=0, x1=4, y1=2), Room(kind="bedroom", x0=0, y0=2.12, x1=4, y1=5.12)),
        openings=(
            Opening(kind="door", axis=0, start=0.3, end=1.2, low=2.0, high=2.12),
            Opening(kind="window", axis=1, start=3.0, end=4.4, low=4.0, high=4.2, z0=0.85, z1=2.15, outside=1),
        ),
        ceiling_m=2.6,
    )


@pytest.fixture(scope="session")
def bare_mesh() -> Callable[..., RenderMesh]:
    """Turns triangles [F, 3, 3] into a white mesh under full light, one cluster per triangle."""

    def build(points_m: np.ndarray, two_sided: bool = True) -> RenderMesh:
        count = len(points_m)
        centre = points_m.mean(axis=1)
        radius = np.linalg.norm(points_m - centre[:, None], axis=2).max(axis=1) + 1e-9
        return RenderMesh(
            points_m=np.ascontiguousarray(points_m, np.float64),
            uv_texel=np.ones((count, 3, 2)),
            light_st=np.zeros((count, 3, 2)),
            texture=np.zeros(count, np.int16),
            two_sided=np.full(count, two_sided),
            light_patch=np.tile([0, 2, 2], (count, 1)).astype(np.int64),
            texels=np.full(1, 255 | 255 << 16 | 255 << 32, np.int64),
            level_offsets=np.zeros((1, 1), np.int64),
            size_bits=np.zeros(1, np.int64),
            light=np.full(4, 512 | 512 << 16 | 512 << 32, np.int64),
            cluster_start=np.arange(count + 1, dtype=np.int64),
            cluster_sphere=np.column_stack([centre, radius]),
        )

    return build
