import numpy as np

from wsm_data.synth.home.furniture import tables


def test_tables_stand_on_their_footprints(style, stands_on_its_footprint):
    rng = np.random.default_rng(0)
    for item in (
        tables.table((1.4, 0.8, 0.75), style.wood, style.dark),
        tables.round_table(0.5, 0.75, style.wood, style.dark),
        tables.dining_set(rng, style, 4),
        tables.round_dining_set(rng, style),
        tables.coffee_table(rng, style),
        tables.side_table(style, lamp=True),
        tables.desk_set(rng, style),
        tables.console(rng, style),
    ):
        stands_on_its_footprint(item)


def test_a_low_robot_fits_between_the_legs_of_a_table_and_a_high_one_does_not(style):
    points = tables.table((1.4, 0.9, 0.75), style.wood, style.dark).surface.points_m.reshape(-1, 3)
    under = (np.abs(points[:, 0]) < 0.55) & (points[:, 1] > 0.15) & (points[:, 1] < 0.75)
    assert not (under & (points[:, 2] < 0.64)).any()
    width = points[points[:, 2] > 0.7]
    assert width[:, 0].max() > 0.69


def test_a_dining_set_has_a_chair_per_seat_and_they_face_the_table(style):
    six = tables.dining_set(np.random.default_rng(0), style, 6)
    assert len(six.footprints) == 1 + 6
    table, *chairs = six.footprints
    assert all(chair[3] < table[3] or chair[1] > table[1] for chair in chairs)


def test_a_lamp_stands_on_the_bedside_table(style):
    assert tables.side_table(style, lamp=False).lamps == ()
    assert tables.side_table(style, lamp=True).lamps[0].xyz_m[2] > 0.8
