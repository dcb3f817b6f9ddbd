"""Which clips this process still has to compare with their checksums: one bit for each."""

from collections.abc import Sequence

from wsm_data.access.open_shards import reads_again_what_it_read
from wsm_data.loaders.config import ReadConfig, Verify
from wsm_data.loaders.sources.clips import SourceTable


class Verification:
    """Says when a clip is due to be checked. Safe to be used by several threads: at worst, a clip is checked twice."""

    def __init__(self, policies: Sequence[Verify], clips_of_sources: Sequence[int]):
        """Remember nothing yet.

        Args:
            policies: when the clips of each source are checked.
            clips_of_sources: clips of each source.
        """
        self._policies = policies
        bits = [
            clips if policy is Verify.FIRST else 0 for policy, clips in zip(policies, clips_of_sources, strict=True)
        ]
        self._checked = [bytearray(-(-clips // 8)) for clips in bits]

    def is_due(self, source: int, number: int) -> bool:
        """Whether a clip, by its source and its number there, must be checked when it is read."""
        if self._policies[source] is not Verify.FIRST:
            return self._policies[source] is Verify.ALWAYS
        return not self._checked[source][number >> 3] >> (number & 7) & 1

    def passed(self, source: int, number: int) -> None:
        """Note that a clip was checked and found whole."""
        if self._policies[source] is Verify.FIRST:
            self._checked[source][number >> 3] |= 1 << (number & 7)


def verification_of(tables: Sequence[SourceTable], read: ReadConfig) -> Verification:
    """What the settings ask for; `first` is `always` where each reading transfers a clip anew from a store."""
    is_kept = [reads_again_what_it_read(table.release.store, read) for table in tables]
    policies = [Verify.ALWAYS if read.verify is Verify.FIRST and not kept else read.verify for kept in is_kept]
    return Verification(policies, [len(table) for table in tables])
