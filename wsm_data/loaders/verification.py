"""Which clips this process still has to compare with their checksums: one bit for each."""

from collections.abc import Sequence

import numpy as np

from wsm_data.loaders.config import Verify


class Verification:
    """Says when a clip is due to be checked. Safe to be used by several threads: at worst, a clip is checked twice."""

    def __init__(self, verify: Verify, clips_of_sources: Sequence[int]):
        self._verify = verify
        bits = clips_of_sources if verify is Verify.FIRST else [0] * len(clips_of_sources)
        self._checked = [np.zeros(-(-clips // 8), np.uint8) for clips in bits]

    def is_due(self, source: int, number: int) -> bool:
        """Whether a clip, by its source and its number there, must be checked when it is read."""
        if self._verify is not Verify.FIRST:
            return self._verify is Verify.ALWAYS
        return not self._checked[source][number >> 3] >> (number & 7) & 1

    def passed(self, source: int, number: int) -> None:
        """Note that a clip was checked and found whole."""
        if self._verify is Verify.FIRST:
            self._checked[source][number >> 3] |= np.uint8(1 << (number & 7))
