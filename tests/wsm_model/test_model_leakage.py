"""Which tokens every token depends on, by gradients through all layers, against the table of the specification.

What a token sees sees no more than the token itself may, so several layers open no other way than one layer does.
"""

from dataclasses import replace

import pytest
import torch

from wsm_model.config import Expert, Variant

FRAMES = 6
CLEAN, PREDICTION = 0, 1
GROUPS = {
    "clean rgb": ((Expert.GENERATION,), CLEAN),
    "clean state": ((Expert.DEPTH, Expert.POSE), CLEAN),
    "noisy rgb": ((Expert.GENERATION,), PREDICTION),
    "state query": ((Expert.DEPTH, Expert.POSE), PREDICTION),
}


def seen_latents(query: str, key: str, latent: int, size: int, variant: Variant) -> list[int]:
    """Latents of a kind of keys that a query of a latent sees: one cell of the table, section 6."""
    chunks = [0 if one == 0 else 1 + (one - 1) // size for one in range(FRAMES)]
    n = chunks[latent]
    earlier = [j for j in range(FRAMES) if chunks[j] < n]
    table = {
        ("clean rgb", "clean rgb"): list(range(latent + 1)),
        ("clean state", "clean state"): list(range(latent + 1)),
        ("noisy rgb", "clean rgb"): earlier,
        ("noisy rgb", "clean state"): earlier if variant is Variant.SLAM else [],
        ("noisy rgb", "noisy rgb"): [j for j in range(FRAMES) if chunks[j] == n],
        ("state query", "clean rgb"): [j for j in range(FRAMES) if chunks[j] <= n],
        ("state query", "clean state"): earlier,
        ("state query", "state query"): [j for j in range(FRAMES) if chunks[j] == n],
    }
    return table.get((query, key), [])


@pytest.fixture(params=[1, 2, 3, 4])
def chunk_size(request) -> int:
    return int(request.param)


@pytest.mark.parametrize("variant", Variant)
def test_gradients_are_exactly_zero_where_the_table_says_no_and_not_where_it_says_yes(
    make_model, make_inputs, make_spans, chunk_size, variant
):
    model, inputs = make_model(variant), make_inputs(make_spans([FRAMES], [chunk_size]))
    table = inputs.table
    streams = {
        expert: replace(stream, x=stream.x.detach().requires_grad_())
        for expert, stream in model.training_streams(inputs, table).items()
    }
    goal = model.goal_context(inputs.goal_camera0_m, table).detach().requires_grad_()
    done = model.run(streams, model._attend(inputs, table, torch.device("cpu")), goal)
    starts = [stream.x for stream in streams.values()]
    for query, (experts, copy) in GROUPS.items():
        for latent in range(FRAMES):
            said = sum(done[one].x[0, copy, latent].square().sum() for one in experts if one in done)
            *found, of_goal = torch.autograd.grad(said, [*starts, goal], retain_graph=True, allow_unused=True)
            gradients = dict(zip(streams, found, strict=True))
            for key, (key_experts, key_copy) in GROUPS.items():
                for one in (expert for expert in key_experts if expert in gradients):
                    wanted = seen_latents(query, key, latent, chunk_size, variant)
                    assert latents_with_gradient(gradients[one], key_copy) == wanted, (query, latent, key, one)
            sees_goal = query == "noisy rgb" or (query == "state query" and variant is Variant.IDM)
            assert (of_goal is not None and bool(of_goal.count_nonzero())) == sees_goal, (query, latent)


def latents_with_gradient(gradient: torch.Tensor | None, copy: int) -> list[int]:
    """Latents of a copy [B, G, F, P, D] whose gradient is not exactly zero."""
    if gradient is None:
        return []
    return gradient[0, copy].flatten(1).count_nonzero(1).nonzero().flatten().tolist()
