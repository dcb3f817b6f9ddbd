import numpy as np
import pytest

from wsm_data.synth.home.furniture import bedding


@pytest.mark.parametrize("width", [0.9, 1.6])
def test_a_bed_stands_on_its_footprint_with_its_head_at_the_wall(style, stands_on_its_footprint, width):
    bed = bedding.bed(np.random.default_rng(0), style, width)
    stands_on_its_footprint(bed)
    points = bed.surface.points_m.reshape(-1, 3)
    assert points[points[:, 2] > 0.85, 1].max() < 0.1
    assert points[:, 1].max() > 2.0


def test_a_bed_set_has_as_many_tables_as_asked_for(style):
    for tables in (1, 2):
        item = bedding.bed_set(np.random.default_rng(0), style, 1.4, tables)
        assert len(item.footprints) == 1 + tables
        assert len(item.lamps) == tables
