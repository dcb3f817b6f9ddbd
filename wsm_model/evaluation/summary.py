"""Many clips' errors in one record of means."""

from collections.abc import Iterable, Sequence
from itertools import zip_longest

import numpy as np

from wsm_data.codecs.quality import psnr_of_sum_db
from wsm_model.evaluation.held_out import ClipErrors, DreamErrors, PictureErrors, StateErrors


def summarise(errors: Sequence[ClipErrors]) -> dict[str, object]:
    """Means over the clips by name; what no clip has is left out.

    PSNR is that of the mean squared error over the clips, None where that is 0; lists are of the latents +1, +2, ...
    """
    states = [one.states for one in errors if one.states is not None]
    dreams = [one.dream for one in errors if one.dream is not None]
    return (_state_means(states) if states else {}) | (_dream_means(dreams) if dreams else {})


def _state_means(states: Sequence[StateErrors]) -> dict[str, object]:
    found: dict[str, object] = {
        name: _mean(getattr(one, name) for one in states)
        for name in (
            "ate_rmse_unaligned_m",
            "ate_rmse_sim3_m",
            "ate_rmse_zero_motion_m",
            "ate_rmse_constant_velocity_m",
            "depth_mse",
            "mean_depth_mse",
        )
    }
    for name in ("abs_rel", "delta1", "log_rmse"):
        for guess, suffix in (("depth", ""), ("constant_map", "_constant_map")):
            errors = [getattr(one, guess) for one in states]
            found[f"depth_{name}{suffix}"] = _mean(getattr(one, name) for one in errors if one is not None)
    return found


def _dream_means(dreams: Sequence[DreamErrors]) -> dict[str, object]:
    found: dict[str, object] = {}
    for name in ("dream", "copy", "shrunk_copy"):
        guesses: list[PictureErrors] = [getattr(one, name) for one in dreams]
        found[f"{name}_psnr_db"] = [_psnr_db(_mean(values)) for values in zip_longest(*(one.mse for one in guesses))]
        found[f"{name}_ssim"] = [_mean(values) for values in zip_longest(*(one.ssim for one in guesses))]
    return found


def _mean(values: Iterable[float | None]) -> float | None:
    """Of those that are known."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _psnr_db(mse: float | None) -> float | None:
    return psnr_of_sum_db(mse, 1) if mse else None
