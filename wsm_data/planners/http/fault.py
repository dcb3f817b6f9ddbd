"""What can go wrong between a planner and its client, by name: each is counted under it, on either side."""

from enum import StrEnum


class Fault(StrEnum):
    """Why a request or an answer was of no use."""

    UNREACHABLE = "unreachable"  # nobody listens, or the network leads nowhere
    LATE = "late"  # it did not come whole within its time
    CUT_OFF = "cut_off"  # the other side went away in the middle
    STATUS = "status"  # an answer that says of itself that it is an error
    TOO_LARGE = "too_large"
    MALFORMED = "malformed"  # not what the protocol says: no JSON, no image, a key missing
    NOT_FINITE = "not_finite"
    WRONG_BATCH = "wrong_batch"  # of another number of environments, or another picture, than was agreed on
    OUT_OF_TURN = "out_of_turn"  # a step before a reset
    UNSUPPORTED = "unsupported"  # the planner has no such ability
    PLANNER = "planner"  # the planner itself cannot answer


class WireError(Exception):
    """A request or an answer that is of no use.

    Args:
        fault: under which it is counted.
        message: what must hold, and what was found.
    """

    def __init__(self, fault: Fault, message: str):
        super().__init__(message)
        self.fault = fault
