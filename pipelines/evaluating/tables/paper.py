"""The figures of the paper's tables, and which numbers of a summary stand beside them.

Rates are percent. The paper drives in the benchmark's home and commercial scenes: other worlds are named, and numbers
of different worlds or protocols are not comparable. Its baselines except LoGoPlanner are point-goal clients, whose
goal is recomputed from the true pose; the benchmark's controller tracks by the true pose in all rows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pipelines.evaluating.tables.row import Figure, TableRow

_HOME, _COMMERCIAL = "InternScenes home", "InternScenes commercial"
_SUCCESS, _SPL = "SR %", "SPL %"


@dataclass(frozen=True, kw_only=True)
class PaperTable:
    """One of the paper's tables.

    Attributes:
        caption: what it shows.
        columns: columns of numbers, each with its name in a summary and the factor to the paper's unit.
        lower_is_better: of all its columns.
        rows: the paper's own.
    """

    caption: str
    columns: Mapping[str, tuple[str, float]]
    lower_is_better: bool
    rows: tuple[TableRow, ...]


def _driven(
    system: str,
    inputs: str,
    goal: str,
    home_success: float,
    home_spl: float,
    commercial_success: float,
    commercial_spl: float,
) -> tuple[TableRow, TableRow]:
    """Rows of home and of commercial scenes."""

    def row(data: str, success: float, spl: float) -> TableRow:
        return TableRow(
            system=system,
            source="paper",
            data=data,
            inputs=inputs,
            goal=goal,
            controller_pose="true",
            protocol="paper",
            figures={_SUCCESS: Figure(value=success), _SPL: Figure(value=spl)},
        )

    return row(_HOME, home_success, home_spl), row(_COMMERCIAL, commercial_success, commercial_spl)


def _mapped(system: str, ate_m: float, accuracy_m: float) -> TableRow:
    return TableRow(
        system=system,
        source="paper",
        data="InternVLN-N1, 5 % test",
        inputs="rgb",
        figures={"ATE RMSE m": Figure(value=ate_m), "Acc. RMSE m": Figure(value=accuracy_m)},
    )


def _navigation(caption: str, systems: Sequence[tuple[TableRow, TableRow]]) -> PaperTable:
    return PaperTable(
        caption=caption,
        columns={_SUCCESS: ("success_rate", 100.0), _SPL: ("spl_geodesic", 100.0)},
        lower_is_better=False,
        rows=tuple(row for pair in systems for row in pair),
    )


_FINAL = (70.3, 66.3, 73.9, 71.8)
_PRETRAINED = (64.6, 61.5, 68.5, 66.9)

PAPER_TABLES: Mapping[str, PaperTable] = MappingProxyType(
    {
        "navigation": _navigation(
            "Start-goal navigation",
            [
                _driven("DD-PPO", "rgb, depth", "oracle", 0.4, 0.4, 5.3, 5.2),
                _driven("iPlanner", "depth", "oracle", 43.0, 40.6, 54.6, 52.8),
                _driven("ViPlanner", "rgb, depth", "oracle", 45.0, 43.2, 63.7, 61.9),
                _driven("LoGoPlanner", "rgb, depth", "fixed", 57.3, 52.4, 67.1, 63.9),
                _driven("LoGoPlanner, re-evaluated", "rgb, depth", "fixed", 59.6, 53.6, 65.8, 62.0),
                _driven("World SLAM Model", "rgb", "fixed", *_FINAL),
            ],
        ),
        "slam": PaperTable(
            caption="SLAM",
            columns={"ATE RMSE m": ("ate_rmse_sim3_m", 1.0), "Acc. RMSE m": ("acc_rmse_m", 1.0)},
            lower_is_better=True,
            rows=(
                _mapped("SLAM-Former, released", 0.051, 0.057),
                _mapped("SLAM-Former, fine-tuned", 0.041, 0.041),
                _mapped("World SLAM Model", 0.021, 0.062),
            ),
        ),
        "idm": _navigation(
            "Inverse dynamics without and with SLAM, both without post-training",
            [
                _driven("IDM, without SLAM", "rgb", "fixed", 28.1, 27.1, 32.1, 31.2),
                _driven("World SLAM Model, pretrained", "rgb", "fixed", *_PRETRAINED),
            ],
        ),
        "backend": _navigation(
            "Local backend, in post-training and in closed loop",
            [
                _driven("without local backend", "rgb", "fixed", 68.3, 65.2, 72.6, 70.5),
                _driven("with local backend", "rgb", "fixed", *_FINAL),
            ],
        ),
        "stages": _navigation(
            "Pretraining and post-training",
            [
                _driven("pretrained", "rgb", "fixed", *_PRETRAINED),
                _driven("post-trained", "rgb", "fixed", *_FINAL),
            ],
        ),
    }
)
