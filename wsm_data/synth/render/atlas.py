"""All textures of a home, with their smaller versions, packed for the renderer."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from wsm_data.schema.arrays import Float64Array
from wsm_data.synth.render import textures_materials as materials
from wsm_data.synth.render import textures_pictures as pictures
from wsm_data.synth.render.surface import Texture

Painter = Callable[[np.random.Generator, int], Float64Array]


def _plain(_: np.random.Generator, size: int) -> Float64Array:
    return np.ones((size, size, 3))


_PAINTERS: dict[Texture, tuple[Painter, int]] = {
    Texture.PLAIN: (_plain, 2),
    Texture.PLASTER: (materials.plaster, 256),
    Texture.PLANKS: (materials.planks, 512),
    Texture.PARQUET: (materials.parquet, 512),
    Texture.TILES: (partial(materials.tiles, count=4, grout=0.62, checker=0.0), 256),
    Texture.WALL_TILES: (partial(materials.tiles, count=8, grout=0.98, checker=0.0), 256),
    Texture.CARPET: (materials.carpet, 256),
    Texture.STRIPES: (partial(materials.stripes, count=4), 256),
    Texture.ORNAMENT: (materials.ornament, 256),
    Texture.DOTS: (materials.dots, 256),
    Texture.WOOD: (materials.wood, 256),
    Texture.FABRIC: (materials.fabric, 256),
    Texture.LEATHER: (materials.leather, 256),
    Texture.STONE: (materials.stone, 256),
    Texture.METAL: (materials.metal, 128),
    Texture.WICKER: (materials.wicker, 128),
    Texture.LEAF: (materials.leaf, 64),
    Texture.BARK: (materials.bark, 64),
    Texture.BOOK: (pictures.book, 64),
    Texture.SCREEN: (pictures.screen, 128),
    Texture.MIRROR: (pictures.mirror, 128),
    Texture.VIEW_GARDEN: (pictures.garden_view, 256),
    Texture.VIEW_TOWN: (pictures.town_view, 256),
    Texture.RUG_BORDER: (pictures.rug_border, 256),
    Texture.RUG_GEOMETRIC: (pictures.rug_geometric, 256),
    Texture.RUG_STRIPED: (pictures.rug_striped, 256),
    Texture.PICTURE_HILLS: (pictures.hills, 128),
    Texture.PICTURE_SEA: (pictures.sea, 128),
    Texture.PICTURE_CIRCLES: (pictures.circles, 128),
    Texture.PICTURE_BLOCKS: (pictures.blocks, 128),
    Texture.PICTURE_STROKES: (pictures.strokes, 128),
    Texture.PICTURE_FLOWER: (pictures.flower, 128),
    Texture.DUVET: (materials.duvet, 256),
    Texture.BRICK: (materials.brick, 256),
}


@dataclass(frozen=True, kw_only=True)
class Atlas:
    """Packed texture layers; the fields are those of `RenderMesh`, and the mean colour of each layer.

    Attributes:
        texels: samples of 3 x 16 bits, red lowest, of which 8 are used; int64.
        level_offsets: first sample of each level of each layer; int64 [L, levels].
        size_bits: binary logarithm of each layer's side; int64 [L].
        mean: mean colour of each layer in [0, 1]; float64 [L, 3].
    """

    texels: NDArray[np.int64]
    level_offsets: NDArray[np.int64]
    size_bits: NDArray[np.int64]
    mean: Float64Array


def paint_atlas(rng: np.random.Generator, used: Collection[int]) -> Atlas:
    """Paint the layers that are used; the others stay plain.

    Each has its own stream of random numbers, so that no layer depends on which others are painted.
    """
    streams = rng.spawn(len(Texture))
    images = []
    for texture in Texture:
        painter, size = _PAINTERS[texture] if texture in used else _PAINTERS[Texture.PLAIN]
        images.append(painter(streams[texture], size))
    size_bits = np.array([image.shape[0].bit_length() - 1 for image in images], np.int64)
    offsets = np.zeros((len(images), int(size_bits.max()) + 1), np.int64)
    packed: list[NDArray[np.int64]] = []
    position = 0
    for layer, image in enumerate(images):
        for level, smaller in enumerate(_levels(image)):
            offsets[layer, level] = position
            packed.append(pack_colours(np.round(smaller * 255)).reshape(-1))
            position += len(packed[-1])
    mean = np.stack([image.mean(axis=(0, 1)) for image in images])
    return Atlas(texels=np.concatenate(packed), level_offsets=offsets, size_bits=size_bits, mean=mean)


def pack_colours(samples: Float64Array) -> NDArray[np.int64]:
    """Whole numbers [..., 3] below 65536 into one int64 each, red in the lowest 16 bits."""
    lanes = samples.astype(np.int64)
    return np.asarray(lanes[..., 0] | (lanes[..., 1] << 16) | (lanes[..., 2] << 32))


def _levels(image: Float64Array) -> list[Float64Array]:
    """The image and its halvings by 2 x 2 means, down to one texel."""
    levels = [image]
    while levels[-1].shape[0] > 1:
        big = levels[-1]
        levels.append((big[::2, ::2] + big[1::2, ::2] + big[::2, 1::2] + big[1::2, 1::2]) / 4)
    return levels
