"""A scene of MiniWorld through a camera of our own: any pinhole, any pose, and depth along its axis in metres."""

import importlib
from typing import Any, ClassVar, Optional

import numpy as np

from wsm_data.geometry.camera import T_OPENGL_OPENCV
from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import Float32Array, Float64Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.sim.miniworld.solids import T_MINIWORLD_WORLD

NEAR_M, FAR_M = 0.1, 60.0
"""What is nearer is cut away, what is farther not drawn. Depth has 16 bits between them, most of them near: a step is
1.4 mm at 3 m and 3.8 mm at 5 m."""

_NOTHING_M = 0.99 * FAR_M


class Viewer:
    """Draws one scene. MiniWorld keeps what stands still under one name for all scenes of a process.

    Args:
        scene: a `MiniWorldEnv`.
        intrinsics: the camera.
    """

    _drawn: ClassVar[Optional["Viewer"]] = None  # whose scene that name stands for
    _windows: ClassVar[list[Any]] = []  # one that is collected takes what the others draw with it

    def __init__(self, scene: Any, intrinsics: Intrinsics):
        self._scene = scene
        self._gl = importlib.import_module("pyglet.gl")
        opengl = importlib.import_module("miniworld.opengl")
        self._windows.append(scene.shadow_window)
        scene.shadow_window.switch_to()
        self._buffer = opengl.FrameBuffer(intrinsics.width, intrinsics.height, 1)
        self._projection = projection(intrinsics)

    def look(self, T_world_camera: Float64Array) -> tuple[Uint8Array, Float32Array]:
        """Colour, uint8 [H, W, 3], and depth along the axis, float32 [H, W], m, 0 where nothing is."""
        gl, scene = self._gl, self._scene
        scene.shadow_window.switch_to()
        if Viewer._drawn is not self:
            scene._render_static()
            Viewer._drawn = self
        self._buffer.bind()
        gl.glClearColor(*scene.sky_color, 1.0)
        gl.glClearDepth(1.0)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
        T_miniworld_opengl = T_MINIWORLD_WORLD @ T_world_camera @ T_OPENGL_OPENCV
        self._load(gl.GL_PROJECTION, self._projection)
        self._load(gl.GL_MODELVIEW, invert(T_miniworld_opengl))
        rgb_u8 = scene._render_world(self._buffer, render_agent=False)
        depth_m = self._buffer.get_depth_map(NEAR_M, FAR_M)[..., 0].astype(np.float32)
        depth_m[depth_m > _NOTHING_M] = 0.0
        return rgb_u8, depth_m

    def _load(self, mode: int, matrix: Float64Array) -> None:
        """Set one of OpenGL's matrices, which stand column by column."""
        self._gl.glMatrixMode(mode)
        self._gl.glLoadMatrixf((self._gl.GLfloat * 16)(*matrix.T.ravel().tolist()))


def projection(intrinsics: Intrinsics) -> Float64Array:
    """OpenGL's projection of a pinhole whose first pixel has its centre at (0, 0); float64 [4, 4].

    A point at (x, y, z) of the OpenCV camera goes to 2 (u + 1/2) / W - 1 and 1 - 2 (v + 1/2) / H of the clip cube, with
    u = fx x / z + cx and v = fy y / z + cy.
    """
    width, height = intrinsics.width, intrinsics.height
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2 * intrinsics.fx / width, 1 - 2 * (intrinsics.cx + 0.5) / width
    matrix[1, 1], matrix[1, 2] = 2 * intrinsics.fy / height, 2 * (intrinsics.cy + 0.5) / height - 1
    matrix[2, 2], matrix[2, 3] = -(FAR_M + NEAR_M) / (FAR_M - NEAR_M), -2 * FAR_M * NEAR_M / (FAR_M - NEAR_M)
    matrix[3, 2] = -1.0
    return matrix
