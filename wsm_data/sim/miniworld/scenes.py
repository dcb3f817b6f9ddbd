"""Scenes of MiniWorld (https://miniworld.farama.org), drawn without a screen. Nobody here made them.

The package is optional, the extra `miniworld`, and is imported when a scene is made. It draws with OpenGL; on a machine
without a screen that needs EGL (Debian: `libegl1` and `libgl1-mesa-dri`).
"""

import importlib
import io
from collections.abc import Mapping
from contextlib import redirect_stdout
from types import MappingProxyType
from typing import Any

from wsm_data.errors import ConfigError

KINDS: Mapping[str, tuple[str, str, Mapping[str, int]]] = MappingProxyType(
    {
        "maze": ("miniworld.envs.maze", "Maze", {"num_rows": 3, "num_cols": 3}),
        "rooms": ("miniworld.envs.fourrooms", "FourRooms", {}),
        "boxes": ("miniworld.envs.putnext", "PutNext", {}),
    }
)
"""The environments that are used, which hold walls, floors and boxes alone: module, class and settings.

A maze of 10 m x 10 m in rooms of 3 m with brick walls, four rooms of 6 m around a cross, and a hall with six boxes."""


def make_scene(kind: str, seed: int) -> Any:
    """A `MiniWorldEnv`, generated from a seed; equal seeds give equal scenes.

    Raises:
        ConfigError: the package, or OpenGL without a screen, is missing.
    """
    module, name, settings = KINDS[kind]
    try:
        importlib.import_module("pyglet").options["headless"] = True  # before anything of it opens a window
        with redirect_stdout(io.StringIO()):  # it says how many samples a pixel has
            scene = getattr(importlib.import_module(module), name)(
                obs_width=8, obs_height=8, window_width=8, window_height=8, **settings
            )
    except ImportError as error:
        raise ConfigError(
            f"the world miniworld needs the package miniworld and OpenGL without a screen, but: {error}; install the "
            "extra: pip install 'wsm[miniworld]', and EGL: apt-get install libegl1 libgl1-mesa-dri"
        ) from error
    scene.reset(seed=seed)
    return scene
