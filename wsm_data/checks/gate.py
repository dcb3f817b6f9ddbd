"""Where verdicts become refusals."""

from wsm_data.errors import DataError
from wsm_data.schema.verdict import Verdict


def require_kept(verdict: Verdict) -> None:
    """Refuse the unit a check did not keep.

    Raises:
        DataError: with the verdict's reason, message and numbers.
    """
    if verdict.reason is not None:
        raise DataError(verdict.reason, verdict.message, verdict.measured)
