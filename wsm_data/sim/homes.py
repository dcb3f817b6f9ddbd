"""Generated homes as worlds."""

from wsm_data.maps.holes import fill_holes
from wsm_data.maps.occupancy import occupancy_for
from wsm_data.maps.scene_map import build_scene_map, floor_levels
from wsm_data.maps.voxels import voxels_from_cloud
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.schema.dataset import CloudColours, Robot
from wsm_data.schema.occupancy import OccupancyGrid
from wsm_data.sim.outlines import Outlines, mesh_outlines
from wsm_data.synth.config import SynthConfig
from wsm_data.synth.home.home import Home, make_home
from wsm_data.synth.render.render import RenderBuffers, make_buffers, render
from wsm_data.synth.writers.cloud import scene_cloud

_REACH_RADII = 3.0
_HOLE_CELLS = 2
_JUST_BELOW_M = 1e-6
"""What begins at the robot's very height it passes below, in the mesh as in the map."""


class HomeWorld:
    """A generated home for a robot; its map is made as the pipeline makes it, from the home's cloud.

    Args:
        home: the home.
        scene: its name.
        robot: the footprint.
        robot_height_m: height of the robot, that of its camera, m.
        intrinsics: the camera.
    """

    def __init__(self, home: Home, scene: str, robot: Robot, robot_height_m: float, intrinsics: Intrinsics):
        self.scene = scene
        self.grid: OccupancyGrid = _map_of(home, robot, robot_height_m)
        self._home = home
        self._intrinsics = intrinsics
        self._outlines: Outlines = mesh_outlines(
            home.mesh.points_m, robot.ground_clearance_m, robot_height_m - _JUST_BELOW_M
        )
        self._reach_m = _REACH_RADII * robot.radius_m
        self._buffers: RenderBuffers = make_buffers(home.mesh, intrinsics)

    def render(self, T_world_camera: Float64Array) -> tuple[Uint8Array, Float32Array]:
        """See `World.render`."""
        return render(self._home.mesh, T_world_camera, self._intrinsics, self._buffers)

    def clearance_m(self, xy_m: Float64Array) -> Float64Array:
        """See `World.clearance_m`; at most three radii are looked at."""
        return self._outlines.clearance_m(xy_m, self._reach_m)


def make_home_world(
    seed: int, scene_index: int, robot: Robot, robot_height_m: float, intrinsics: Intrinsics
) -> HomeWorld:
    """Home number `scene_index` of a seed; homes of other seeds than a model was trained on were never seen."""
    home = make_home(seed, scene_index, robot.ground_clearance_m)
    return HomeWorld(home, f"home_{seed}_{scene_index:04d}", robot, robot_height_m, intrinsics)


def _map_of(home: Home, robot: Robot, robot_height_m: float) -> OccupancyGrid:
    voxels = voxels_from_cloud(scene_cloud(home, SynthConfig()), CloudColours())
    scene_map = build_scene_map(voxels, floor_levels([0.0]), robot, robot_height_m)
    return fill_holes(occupancy_for(scene_map, 0.0, robot_height_m, robot), _HOLE_CELLS)[0]
