import sys

import pytest

from wsm_data.errors import ConfigError
from wsm_data.sim.miniworld.scenes import make_scene


def test_without_the_package_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyglet", None)  # as if it were not there
    with pytest.raises(ConfigError, match=r"wsm\[miniworld\].*libegl1"):
        make_scene("maze", 0)
