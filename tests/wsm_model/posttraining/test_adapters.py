import pytest
import torch

from wsm_model.inference.sampler import flow_schedule
from wsm_model.inference.session import Session, SessionConfig
from wsm_model.posttraining.adapters import ADAPTER_WEIGHTS, AdaptedModel, Policy
from wsm_model.posttraining.config import AdapterConfig
from wsm_model.posttraining.dream_attention import with_dream_attention

peft = pytest.importorskip("peft")


@pytest.fixture
def adapted(make_model):
    torch.manual_seed(1)
    return AdaptedModel(make_model(), AdapterConfig(rank=2, alpha=4))


def change(adapted, seed=2):
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in adapted.trained():
            parameter.add_(0.3 * torch.randn(parameter.shape, generator=generator))


def dreamed(model, config):
    """A dream, and all states that were estimated of a fixed video."""
    generator = torch.Generator().manual_seed(5)
    shape = (config.latent_channels, config.latent_height, config.latent_width)
    session = Session(model, SessionConfig(chunk_size=2))
    episode = session.start()
    seen = session.observe_all(episode, torch.randn(5, *shape, generator=generator))
    noise = torch.randn(1, 1, 2, *shape, generator=generator)
    [dream] = session.dream([episode], torch.ones(1, 3), noise, flow_schedule(3, 5.0))
    return dream, seen


def test_new_adapters_change_nothing(adapted, make_model, config):
    """To 1e-5: the products of dreams are of other shapes than before."""
    before, _ = dreamed(make_model(), config)
    for policy in Policy:
        with adapted.acting(policy) as model:
            torch.testing.assert_close(dreamed(model, config)[0].rgb, before.rgb, atol=1e-5, rtol=1e-5)


def test_gradients_reach_the_trained_adapter_alone(adapted, make_inputs, make_spans):
    adapted.model(make_inputs(make_spans([4], [2]))).velocity.square().sum().backward()
    learning = {id(one) for one in adapted.trained()}
    reached = {id(one) for one in adapted.model.parameters() if one.grad is not None}
    assert reached == learning
    assert len(learning) == 2 * 4 * adapted.model.config.layers  # two matrices on each of q, k, v and o


def test_what_slam_says_of_a_video_is_the_same_to_the_bit_whatever_is_learned(adapted, make_model, config):
    dream, before = dreamed(make_model(), config)
    change(adapted)
    other, after = dreamed(adapted.model, config)
    assert torch.equal(after.poses, before.poses)
    assert torch.equal(after.depth, before.depth)
    assert not torch.allclose(other.rgb, dream.rgb)


def test_policies_differ_and_come_back(adapted, config):
    first, _ = dreamed(adapted.model, config)
    change(adapted)
    trained, _ = dreamed(adapted.model, config)
    with adapted.acting(Policy.OLD) as model:
        assert torch.equal(dreamed(model, config)[0].rgb, first.rgb)
    with adapted.pretrained() as model:
        torch.testing.assert_close(dreamed(model, config)[0].rgb, first.rgb, atol=1e-5, rtol=1e-5)
    assert torch.equal(dreamed(adapted.model, config)[0].rgb, trained.rgb)
    assert all(one.requires_grad for one in adapted.trained())


def test_the_old_policy_follows_by_its_decay(adapted):
    old = [one.clone() for name, one in adapted.kept.named_parameters() if "/old/" in name]
    change(adapted)
    adapted.follow(0.75)
    now = [one for name, one in adapted.kept.named_parameters() if "/old/" in name]
    for before, after, trained in zip(old, now, adapted.trained(), strict=True):
        torch.testing.assert_close(after, 0.75 * before + 0.25 * trained)


def test_a_merged_model_is_base_and_adapter(adapted, config):
    """To 1e-6: one product of matrices instead of two, in float32."""
    change(adapted)
    expected, states = dreamed(adapted.model, config)
    found, merged_states = dreamed(adapted.merged().eval(), config)
    torch.testing.assert_close(found.rgb, expected.rgb, atol=1e-5, rtol=1e-5)  # three steps of the sampler add up
    assert torch.equal(merged_states.poses, states.poses)


def test_the_adapter_is_written_as_peft_reads_it(adapted, make_model, config, tmp_path):
    change(adapted)
    adapted.save(tmp_path)
    assert (tmp_path / ADAPTER_WEIGHTS).stat().st_size > 0
    model = with_dream_attention(make_model()).eval()
    read = peft.PeftModel.from_pretrained(model, str(tmp_path))
    expected, _ = dreamed(adapted.model, config)
    assert torch.equal(dreamed(read.base_model.model, config)[0].rgb, expected.rgb)
