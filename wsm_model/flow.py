"""The path from latents to noise (paper, equation 7 and appendix A.1).

x_tau = (1 - tau) x + tau eps with tau in [0, 1] (1 is noise); the model predicts its velocity eps - x. One tau per
chunk, drawn uniformly and shifted towards noise.
"""

from torch import Tensor


def shifted_flow_time(uniform: Tensor, shift: float) -> Tensor:
    """Flow time tau = gamma s / (1 + (gamma - 1) s) of s in [0, 1] (paper, appendix A.1)."""
    return shift * uniform / (1 + (shift - 1) * uniform)


def noised(clean: Tensor, noise: Tensor, flow_time: Tensor) -> Tensor:
    """(1 - tau) x + tau eps; `flow_time` [...] has the leading dimensions of `clean`."""
    tau = flow_time.reshape(*flow_time.shape, *[1] * (clean.dim() - flow_time.dim()))
    return (1 - tau) * clean + tau * noise
