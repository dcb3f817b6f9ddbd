"""Measured numbers against their limits."""

from collections.abc import Mapping

from wsm_data.errors import Reason
from wsm_data.schema.verdict import Verdict


def verdict_within(limits: Mapping[str, tuple[float, float, float]], reason: Reason, what: str) -> Verdict:
    """Keep a record whose measured numbers all lie within their limits, borders included.

    Args:
        limits: by name, with its unit: the number, and the lowest and highest it may be. NaN lies nowhere.
        reason: why the record is refused otherwise.
        what: beginning of the message, the record named: what does not hold then.
    """
    measured = {name: value for name, (value, _, _) in limits.items()}
    allowed = {name: (low, high) for name, (_, low, high) in limits.items()}
    broken = [
        f"{name} must lie in [{low:g}, {high:g}], found {value:.4g}"
        for name, (value, low, high) in limits.items()
        if not low <= value <= high
    ]
    if not broken:
        return Verdict(measured=measured, limits=allowed)
    return Verdict(reason=reason, message=f"{what}: {'; '.join(broken)}", measured=measured, limits=allowed)
