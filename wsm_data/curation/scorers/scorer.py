"""What a score is: a pure function of a small frozen value, with what it says of itself."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from wsm_data.curation.scores_table import ScorerInfo

InputT = TypeVar("InputT")


@dataclass(frozen=True, kw_only=True)
class Scorer(Generic[InputT]):
    """One score.

    Attributes:
        info: name, unit, direction and meaning.
        score: the score of one clip; None where it has none, which only scores with `info.absent` may give.
    """

    info: ScorerInfo
    score: Callable[[InputT], float | None]


def require_score(info: ScorerInfo, value: float | None, key: str) -> float:
    """A score as it is stored: NaN where it is absent.

    Raises:
        ValueError: the scorer computed NaN or infinity, or nothing where it promises a value; that is its bug.
    """
    if value is None and info.absent:
        return float("nan")
    if value is None or not abs(value) < float("inf"):
        raise ValueError(f"the score {info.name} of clip {key} must be a finite number, found {value}")
    return float(value)
