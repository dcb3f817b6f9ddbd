"""Where verdicts become refusals."""

from collections.abc import Sequence

from wsm_data.errors import DataError
from wsm_data.schema.verdict import Verdict


def joined_verdict(verdicts: Sequence[Verdict]) -> Verdict:
    """One verdict of several: refused under the first reason, with all of them in its message and under `also`."""
    broken = [verdict for verdict in verdicts if not verdict.keep]
    if len(broken) < 2:
        return broken[0] if broken else Verdict()
    first, *others = broken
    message = "; also ".join([first.message, *(f"{one.reason}: {one.message}" for one in others)])
    also = [{"reason": str(one.reason), "measured": one.measured} for one in others]
    return Verdict(reason=first.reason, message=message, measured={**first.measured, "also": also})


def require_kept(*verdicts: Verdict) -> None:
    """Refuse the unit that a check did not keep.

    Raises:
        DataError: with the first reason, and the messages and numbers of all.
    """
    verdict = joined_verdict(verdicts)
    if verdict.reason is not None:
        raise DataError(verdict.reason, verdict.message, verdict.measured)
