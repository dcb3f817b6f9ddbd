import numpy as np

from wsm_data.synth.home.floor_plan import Room
from wsm_data.synth.home.style import choose_room_style, choose_style
from wsm_data.synth.render.surface import Texture


def room(kind: str) -> Room:
    return Room(kind=kind, x0=0, y0=0, x1=4, y1=3)


def test_homes_do_not_look_alike():
    styles = [choose_style(np.random.default_rng(seed)) for seed in range(12)]
    assert len({style.scheme.wood for style in styles}) >= 3
    assert len({style.cloth[0].tint for style in styles}) >= 5


def test_wet_rooms_are_tiled_and_dry_ones_are_not(style):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        assert choose_room_style(rng, room("bath"), style, 1).floor.texture == Texture.TILES
        assert choose_room_style(rng, room("bath"), style, 1).lower.texture == Texture.WALL_TILES
        assert choose_room_style(rng, room("living"), style, 2).floor.texture != Texture.TILES


def test_rooms_with_other_numbers_have_other_walls(style):
    tints = {choose_room_style(np.random.default_rng(0), room("study"), style, i).wall.tint for i in range(5)}
    assert len(tints) == 5
