"""What every piece of furniture has to be."""

from collections.abc import Callable

import numpy as np
import pytest

from wsm_data.synth.home.furniture.piece import Piece


@pytest.fixture(scope="session")
def stands_on_its_footprint() -> Callable[[Piece], None]:
    """Checks that a piece stands on the floor, within its footprints (to a few cm) and no higher than it says."""

    def check(item: Piece) -> None:
        points = item.surface.points_m.reshape(-1, 3)
        assert np.isfinite(points).all()
        assert points[:, 2].min() == pytest.approx(0.0, abs=0.05)
        assert points[:, 2].max() < item.height_m + 0.6  # things may stand on it
        taken = np.array(item.footprints)
        low, high = taken[:, :2].min(axis=0), taken[:, 2:].max(axis=0)
        obstacle = points[(points[:, 2] > 0.15) & (points[:, 2] < 1.5), :2]
        assert (obstacle > low - 0.3).all()
        assert (obstacle < high + 0.3).all()
        lengths = np.linalg.norm(item.surface.normals, axis=-1)
        assert lengths == pytest.approx(np.ones_like(lengths), abs=1e-6)

    return check
