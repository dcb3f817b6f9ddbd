"""What one planning step of the agent costs, part by part, and how that grows with what it has seen.

The tiny size with random weights on the built-in codec, at the benchmark's 640 x 360 px, on one thread: time does not
depend on what weights say. One step is four frames, one latent, the states of the current chunk, a dream of 8 steps.
"""

import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from reporting import machine, machine_line, table, write_results

from wsm_data.codecs.dct import DctCodec
from wsm_data.planners.planner import GoalFrame, Observation
from wsm_data.schema.latent_standard import LatentStandard
from wsm_data.sim.config import SimConfig
from wsm_model.agent.agent import Agent
from wsm_model.agent.config import AgentConfig
from wsm_model.agent.eye import Eye
from wsm_model.inference import session
from wsm_model.model import WorldSlamModel
from wsm_model.presets import preset

SEEN, REPEATS = (2, 16, 32, 64, 96, 127), 3
PARTS = {
    "see": "resize and encode 4 frames",
    "clean_rgb": "clean RGB: the new latent, and the dreamed chunk",
    "query_states": "state queries: the current chunk, and the dreamed one",
    "clean_states": "clean states of the current chunk",
    "velocity": "dream: 8 steps of the flow",
}


class Clock:
    """Seconds spent in functions, by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*args: Any, **words: Any) -> Any:
            start = time.process_time()
            result = function(*args, **words)
            self.seconds[name] += time.process_time() - start
            return result

        return timed


def make_agent(clock: Clock) -> Agent:
    torch.manual_seed(0)
    config = preset("tiny")
    zeros, ones = (0.0,) * config.latent_channels, (1.0,) * config.latent_channels
    codec = DctCodec()
    standard = LatentStandard(
        codec="dct",
        codec_digest=codec.describe().digest,
        rgb_mean=zeros,
        rgb_std=ones,
        depth_mean=zeros,
        depth_std=ones,
    )
    eye = Eye(codec, standard, config)
    eye.see = clock.around("see", eye.see)
    for name in ("clean_rgb", "query_states", "clean_states", "velocity"):
        setattr(session, name, clock.around(name, getattr(session, name)))
    return Agent(WorldSlamModel(config).eval(), eye, AgentConfig())


def measure(clock: Clock) -> dict[int, dict[str, list[float]]]:
    """Seconds of the parts of a planning step, by the latents seen: three steps, the first after that many."""
    agent, camera = make_agent(clock), SimConfig().intrinsics
    agent.reset(camera, 1)
    picture = np.random.default_rng(0).integers(0, 256, (camera.height, camera.width, 3), dtype=np.uint8)
    found: dict[int, dict[str, list[float]]] = {}
    wanted = {seen + offset: seen for seen in SEEN for offset in range(REPEATS)}
    dream = agent._session.dream
    for latent in range(max(wanted) + 1):
        # what is not measured is only seen: its dream would take most of the time
        agent._session.dream = dream if latent in wanted else lambda *_: [NOTHING]
        clock.seconds.clear()
        start = time.process_time()
        for frame in range(4 if latent else 1):
            step = 4 * latent + frame - (3 if latent else 0)
            shown = Observation(step=step, goal_xy_m=np.array([4.0, 1.0]), goal_frame=GoalFrame.START, rgb_u8=picture)
            agent.plan({0: shown})
        if latent in wanted:
            own = found.setdefault(wanted[latent], defaultdict(list))
            for name in PARTS:
                own[name].append(clock.seconds[name])
            own["all"].append(time.process_time() - start)
    return found


NOTHING = session.Dream(
    first=0, rgb=torch.zeros(1, 4, 1), depth=None, poses=torch.tensor([0.0, 0, 0, 1, 0, 0, 0]).expand(1, 4, 4, 7)
)


def main() -> None:
    torch.set_num_threads(1)
    found = measure(Clock())
    medians = {
        seen: {name: 1000 * statistics.median(own[name]) for name in (*PARTS, "all")} for seen, own in found.items()
    }
    spread = max((max(own["all"]) - min(own["all"])) / statistics.median(own["all"]) for own in found.values())
    place = machine("numpy", "torch")
    rows = [
        [text, *(f"{own[name]:,.0f}" for own in medians.values())]
        for name, text in {**PARTS, "all": "**one planning step**"}.items()
    ]
    growth = medians[SEEN[-1]]["all"] / medians[SEEN[0]]["all"]
    lines = [
        "# One planning step of the agent",
        "",
        "The tiny size, latents of 20 x 12 cells, one thread; milliseconds of processor time, medians of three steps,",
        "by latents seen. The cache is full at 128.",
        "",
        *table(["part", *(f"{seen}" for seen in medians)], rows),
        "",
        f"With {SEEN[-1]} latents a step takes {growth:.2f} times what it takes with {SEEN[0]}. Largest spread of "
        f"three steps: {spread:.0%} of their median.",
        "",
        machine_line(place),
    ]
    write_results("agent", {"machine": place, "milliseconds": medians, "growth": growth, "spread": spread}, lines)


if __name__ == "__main__":
    main()
