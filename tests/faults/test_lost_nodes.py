"""A ray cluster of three nodes on this machine: a node is killed under its task, and releases have the same bytes."""

import threading
import time
from pathlib import Path

import fake_tasks
import node_tasks
import pytest
import ray
from fake_runs import ANY, copies
from fake_stages import COPY
from ray.cluster_utils import Cluster

from pipelines.running.engines.ray import run_ray
from pipelines.running.runner import run_stage

pytestmark = pytest.mark.slow


@pytest.fixture
def cluster(monkeypatch):
    """Three nodes with a CPU each; the driver is on a fourth, which has none."""
    folders = [str(Path(module.__file__).parent) for module in (fake_tasks, node_tasks)]
    monkeypatch.setenv("PYTHONPATH", ":".join([*folders, str(Path(__file__).parents[2])]))
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    nodes = [cluster.add_node(num_cpus=1) for _ in range(3)]
    ray.init(address=cluster.address, logging_level="ERROR")
    cluster.wait_for_nodes()
    yield cluster, nodes
    ray.shutdown()
    cluster.shutdown()


def test_what_a_killed_node_was_doing_is_done_by_another(cluster, tmp_path, faults):
    cluster, nodes = cluster
    marks = [tmp_path / name for name in "abc"]
    found = []
    run = threading.Thread(
        target=lambda: found.extend(run_ray([str(mark) for mark in marks], node_tasks.say_where_and_wait, 3))
    )
    run.start()
    end = time.monotonic() + 120
    while not all(mark.exists() and mark.read_text().endswith("\n") for mark in marks) and time.monotonic() < end:
        time.sleep(0.05)
    where = [mark.read_text().splitlines() for mark in marks]
    assert len({one for (one,) in where}) == 3  # each on a node of its own
    [killed] = [node for node in nodes if node.node_id == where[0][0]]
    cluster.remove_node(killed, allow_graceful=False)
    (tmp_path / "go").touch()
    run.join(timeout=200)
    assert sorted(found) == [str(mark) for mark in marks]
    attempts = [mark.read_text().splitlines() for mark in marks]
    assert [len(one) for one in attempts] == [2, 1, 1]
    assert attempts[0][1] != attempts[0][0]
    faults["ray nodes killed"] += 1


@pytest.mark.usefixtures("cluster")
def test_three_nodes_write_the_bytes_of_one_process(config, out, tmp_path):
    (config.source / "a3.txt").write_text("bad")
    run_stage(COPY, config, out, ANY)
    spread = tmp_path / "spread"
    run_stage(COPY, config, spread, ANY, lambda tasks, work, _: run_ray(tasks, work, 3))
    assert copies(spread) == copies(out)
    assert (spread / "words.json").read_bytes() == (out / "words.json").read_bytes()
