import pytest

from wsm_model.evaluation.flow import flow_matching_errors


def test_copying_is_exact_where_nothing_changes_and_the_unconditional_guess_is_right_on_average(make_model, batch):
    model = make_model(latent_channels=48)
    batch.rgb = batch.rgb[:, :1].expand(-1, 5, -1, -1, -1).clone()
    errors = flow_matching_errors(model, [batch], seed=0, shift=5.0)
    assert errors.copy == pytest.approx(0.0, abs=1e-9)
    assert 0 < errors.unconditional < 2.2  # at most the variance of eps - x, times weights of mean one
