"""Least, greatest, mean and deviation of a feature over a data set, as LeRobot keeps them for normalisation."""

import numpy as np

from wsm_data.schema.arrays import Float64Array


class RunningStatistics:
    """Statistics of the columns of rows that come in pieces; sums are float64.

    Args:
        columns: numbers in a row.
    """

    def __init__(self, columns: int):
        self._count = 0
        self._least, self._greatest = np.full(columns, np.inf), np.full(columns, -np.inf)
        self._mean, self._squares = np.zeros(columns), np.zeros(columns)

    def add(self, rows: np.ndarray) -> None:
        """Take rows [N, columns] in; the sums of two sets are joined as Chan, Golub and LeVeque (1979) do."""
        if not len(rows):
            return
        values: Float64Array = np.asarray(rows, np.float64)
        mean, total = values.mean(axis=0), self._count + len(values)
        change = mean - self._mean
        self._squares += ((values - mean) ** 2).sum(axis=0) + change**2 * (self._count * len(values) / total)
        self._mean += change * (len(values) / total)
        self._count = total
        self._least = np.minimum(self._least, values.min(axis=0))
        self._greatest = np.maximum(self._greatest, values.max(axis=0))

    def summary(self, shape: tuple[int, ...]) -> dict[str, object]:
        """`min`, `max`, `mean` and `std` in a shape of as many numbers, and `count`; empty where nothing came."""
        if not self._count:
            return {}
        deviation = np.sqrt(self._squares / self._count)
        parts = {"min": self._least, "max": self._greatest, "mean": self._mean, "std": deviation}
        return {**{name: part.reshape(shape).tolist() for name, part in parts.items()}, "count": [self._count]}
