from wsm_data.view.release.drop_examples import drop_examples


def test_each_reason_comes_with_its_first_refusal_by_unit(release):
    drops = drop_examples(release)
    assert [(drop.reason, drop.units, drop.refusals) for drop in drops] == [
        ("path.through_obstacle", 2, 2),
        ("archive.truncated", 1, 1),
    ]
    assert (drops[0].unit, drops[0].stage, drops[0].message) == ("synth_d435i/home_0002/000007", "encode", "first")


def test_nothing_dropped_is_an_empty_list(tmp_path, made):
    assert drop_examples(made.release(tmp_path, {"a_d435i/home/000000": "train"}, refusals=())) == ()
