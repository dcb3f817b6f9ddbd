"""Does the expert drive over floor that the scene's cloud shows?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float64Array
from wsm_data.schema.occupancy import UNKNOWN, OccupancyGrid
from wsm_data.schema.verdict import Verdict


def check_path_shown(grid: OccupancyGrid, path_xy_m: Float64Array, where: str, max_unknown_share: float) -> Verdict:
    """Refuse a path over cells that the cloud never showed (`path.off_map`): its sweep would free them.

    Args:
        grid: the map from the cloud alone, reaching as far as the path.
        path_xy_m: camera positions in the world, m; [T, 2].
        where: what to call the trajectory in the message.
        max_unknown_share: the limit.
    """
    columns, rows = np.floor(grid.fractional_cells(path_xy_m) + 0.5).astype(np.int64).T
    unknown = grid.cells[rows, columns] == UNKNOWN
    share = float(np.mean(unknown))
    measured: dict[str, object] = {"unknown_path_share": share}
    limits = {"unknown_path_share": max_unknown_share}
    if share <= max_unknown_share:
        return Verdict(measured=measured, limits=limits)
    first = int(np.argmax(unknown))
    message = (
        f"{where}: at most {max_unknown_share:.0%} of the path may lead over floor that the cloud never showed, "
        f"found {share:.0%}, first at frame {first}; is it this scene's cloud, whole and in the same world?"
    )
    details = {**measured, "frame": first}
    return Verdict(reason=Reason.PATH_OFF_MAP, message=message, measured=details, limits=limits)
