"""Pictures of a mesh: colour and exact depth of a pinhole camera."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wsm_data.geometry.transform import invert
from wsm_data.schema.arrays import BoolArray, Float32Array, Float64Array, Int16Array, Uint8Array
from wsm_data.schema.camera import Intrinsics
from wsm_data.synth.render.rasteriser import PLANES, draw, shade


@dataclass(frozen=True, kw_only=True)
class RenderMesh:
    """F textured and lit triangles in world coordinates, in C clusters that are skipped together when out of view.

    Attributes:
        points_m: corners; float64 [F, 3, 3]. The front shows (1 - 0) x (2 - 0).
        uv_texel: texture coordinates of the corners, never negative; float64 [F, 3, 2].
        light_st: light coordinates of the corners in nodes of the triangle's patch; float64 [F, 3, 2].
        texture: layer of each triangle; int16 [F].
        two_sided: whether the back is drawn; bool [F].
        light_patch: first sample, columns and rows of the patch in `light`; int64 [F, 3].
        texels: packed texture samples of all layers and levels; int64.
        level_offsets: first sample of each level of each layer; int64 [L, levels].
        size_bits: binary logarithm of each layer's side; int64 [L].
        light: packed light samples; int64.
        cluster_start: first triangle of each cluster, and F; int64 [C + 1].
        cluster_sphere: bounding spheres, centre and radius, m; float64 [C, 4].
    """

    points_m: Float64Array
    uv_texel: Float64Array
    light_st: Float64Array
    texture: Int16Array
    two_sided: BoolArray
    light_patch: NDArray[np.int64]
    texels: NDArray[np.int64]
    level_offsets: NDArray[np.int64]
    size_bits: NDArray[np.int64]
    light: NDArray[np.int64]
    cluster_start: NDArray[np.int64]
    cluster_sphere: Float64Array


@dataclass(frozen=True, kw_only=True)
class RenderBuffers:
    """Working memory and results of one image size, written anew by every `render` that is given them."""

    inv_z: Float64Array
    ids: NDArray[np.int32]
    planes: Float64Array
    rgb_u8: Uint8Array
    depth_m: Float32Array


def make_buffers(mesh: RenderMesh, intrinsics: Intrinsics) -> RenderBuffers:
    """Buffers for pictures of `mesh` in the size of `intrinsics`."""
    size = (intrinsics.height, intrinsics.width)
    return RenderBuffers(
        inv_z=np.empty(size),
        ids=np.empty(size, np.int32),
        planes=np.empty((len(mesh.points_m) + 1, PLANES)),
        rgb_u8=np.empty((*size, 3), np.uint8),
        depth_m=np.empty(size, np.float32),
    )


def render(
    mesh: RenderMesh, T_world_camera: Float64Array, intrinsics: Intrinsics, buffers: RenderBuffers | None = None
) -> tuple[Uint8Array, Float32Array]:
    """Picture of the mesh, sampled at pixel centres, where the centre of the first pixel is at (0, 0).

    Args:
        mesh: what is seen.
        T_world_camera: OpenCV camera (x right, y down, z forward) to world, m; float64 [4, 4].
        intrinsics: the camera; its width and height are those of the picture.
        buffers: memory to work in and to return the results in, valid until its next use; new when None.

    Returns:
        rgb_u8 [H, W, 3] and depth_m float32 [H, W], the depth along the optical axis; both 0 where nothing is seen.

    Raises:
        ValueError: the buffers are of another size.
    """
    used = buffers or make_buffers(mesh, intrinsics)
    if used.inv_z.shape != (intrinsics.height, intrinsics.width) or len(used.planes) <= len(mesh.points_m):
        raise ValueError(f"buffers of {used.inv_z.shape} do not fit this mesh and {intrinsics}; use make_buffers")
    T_camera_world = np.ascontiguousarray(invert(np.asarray(T_world_camera, np.float64))[:3])
    draw(
        mesh.points_m,
        mesh.uv_texel,
        mesh.light_st,
        mesh.two_sided,
        mesh.cluster_start,
        mesh.cluster_sphere,
        T_camera_world,
        intrinsics.matrix,
        _view_limits(intrinsics),
        used.inv_z,
        used.ids,
        used.planes,
    )
    shade(
        used.inv_z,
        used.ids,
        used.planes,
        mesh.texture,
        mesh.texels,
        mesh.level_offsets,
        mesh.size_bits,
        mesh.light,
        mesh.light_patch,
        used.rgb_u8,
        used.depth_m,
    )
    return used.rgb_u8, used.depth_m


def _view_limits(camera: Intrinsics) -> Float64Array:
    """Inward unit normals of the four planes through the camera and the image's outermost pixel centres; [4, 3]."""
    right, bottom = camera.width - 1 - camera.cx, camera.height - 1 - camera.cy
    normals = np.array(
        [(camera.fx, 0.0, camera.cx), (-camera.fx, 0.0, right), (0.0, camera.fy, camera.cy), (0.0, -camera.fy, bottom)]
    )
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
