"""The path from latents to noise (paper, equation 7 and appendix A.1).

x_tau = (1 - tau) x + tau eps with tau in [0, 1] (1 is noise); the model says its velocity eps - x. One tau per chunk,
drawn uniformly and shifted towards noise.
"""

from torch import Tensor

from wsm_model.config import Prediction

LEAST_FLOW_TIME = 0.05
"""Where x is predicted, v = (x_tau - x) / tau is taken at no smaller tau: errors of x would grow beyond all bounds.

The bound of the program of arXiv 2511.13720.
"""


def shifted_flow_time(uniform: Tensor, shift: float) -> Tensor:
    """Flow time tau = gamma s / (1 + (gamma - 1) s) of s in [0, 1] (paper, appendix A.1)."""
    return shift * uniform / (1 + (shift - 1) * uniform)


def noised(clean: Tensor, noise: Tensor, flow_time: Tensor) -> Tensor:
    """(1 - tau) x + tau eps; `flow_time` [...] has the leading dimensions of `clean`."""
    tau = _like(flow_time, clean)
    return (1 - tau) * clean + tau * noise


def velocity_of(prediction: Prediction, read: Tensor, noisy: Tensor, flow_time: Tensor) -> Tensor:
    """The velocity that the head's values stand for.

    Of a predicted x it is v = (x_tau - x) / tau, with tau at least `LEAST_FLOW_TIME`: its squared error is that of x
    over tau^2 (x-prediction with the v-loss, arXiv 2511.13720). At tau = 1 what is predicted is the mean of
    what may follow, a smooth picture, and not noise of full rank.

    Args:
        prediction: what the head says.
        read: its values, [..., C, h, w].
        noisy: x_tau, the same shape.
        flow_time: tau, [...].
    """
    if prediction is Prediction.VELOCITY:
        return read
    return (noisy.float() - read.float()) / _like(flow_time, read).clamp(min=LEAST_FLOW_TIME)


def _like(flow_time: Tensor, latents: Tensor) -> Tensor:
    return flow_time.reshape(*flow_time.shape, *[1] * (latents.dim() - flow_time.dim()))
