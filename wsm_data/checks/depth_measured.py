"""Has every depth image measured anything?"""

import numpy as np

from wsm_data.errors import Reason
from wsm_data.schema.arrays import Float32Array
from wsm_data.schema.verdict import Verdict


def check_depth_measured(depth_m: Float32Array, where: str) -> Verdict:
    """Refuse depth with a frame that holds no measurement at all (`depth.no_measurement`).

    Args:
        depth_m: depth along the optical axis, m, 0 where there is no measurement; float32 [T, H, W].
        where: what to call the trajectory in the message.
    """
    share = np.count_nonzero(depth_m, axis=(1, 2)) / (depth_m.shape[1] * depth_m.shape[2])
    measured = {"min_measured_share": float(share.min()), "mean_measured_share": float(share.mean())}
    blind = np.flatnonzero(share == 0)
    if len(blind) == 0:
        return Verdict(measured=measured)
    message = (
        f"{where}: every depth image must hold a measurement; {len(blind)} of {len(share)} hold none, the first is "
        f"frame {blind[0]}"
    )
    details = {**measured, "frame": int(blind[0]), "frames": len(blind)}
    return Verdict(reason=Reason.DEPTH_NO_MEASUREMENT, message=message, measured=details)
