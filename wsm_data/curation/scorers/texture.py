"""How much there is to see."""

import numpy as np

from wsm_data.curation.scorers.clip_images import ClipImages
from wsm_data.curation.scorers.scorer import Scorer
from wsm_data.curation.scores_table import Direction, ScorerInfo


def texture_ratio(images: ClipImages) -> float:
    """Variance of the colour latents between the cells of a picture, over their variance in the release.

    Mean over channels and latents of var_cells(channel) / std_release(channel)^2: 0 for a blank wall, about 1 for an
    ordinary picture. No channel needs a meaning, so it holds for any codec; but values of two codecs, or of two
    releases, cannot be compared, noise counts as texture, and channels that do not vary in the release are left out.
    """
    varies = images.rgb_std > 0
    if not varies.any():
        return 0.0
    latents = images.rgb_latent[:, varies].astype(np.float64)
    variance = latents.var(axis=(2, 3)) / images.rgb_std[varies] ** 2
    return float(variance.mean())


TEXTURE = Scorer(
    info=ScorerInfo(
        name="texture_ratio",
        unit="ratio",
        direction=Direction.LOWER,
        summary="variance of colour latents within pictures over that in the release",
    ),
    score=texture_ratio,
)
