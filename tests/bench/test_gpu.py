"""The script for a GPU, tried on a processor with nothing but what it says it needs."""

import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "bench" / "gpu.py"
ALONE = """
import re, runpy, sys
from importlib.metadata import packages_distributions, requires
wanted = {re.match("[A-Za-z0-9_.-]+", one)[0].lower().replace("_", "-") for one in requires("wsm")}
for module, packages in packages_distributions().items():
    names = {one.lower().replace("_", "-") for one in packages}
    if names & wanted - {"wsm", "torch", "numpy", "safetensors"}:
        sys.modules[module] = None
sys.argv = sys.argv[1:]
sys.path.insert(0, sys.argv[0].rpartition("/")[0])
runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""Whatever else this project depends on is not there."""


def test_it_measures_every_part_with_torch_numpy_and_safetensors_alone(tmp_path):
    command = [sys.executable, "-c", ALONE, str(SCRIPT), "--device", "cpu", "--out", str(tmp_path)]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "OMP_NUM_THREADS": "1"}, timeout=300
    )
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "gpu.json").read_text())
    exact, rounded = found["compared"]
    assert float(exact[1]) < 1e-4
    assert 1e-4 < float(rounded[1]) < 0.2
    (step, plan) = found["measured"]
    assert float(step[2]) > 0
    assert float(plan[1]) > 0
    assert "A planning step" in (tmp_path / "gpu.md").read_text()


def test_without_a_gpu_it_says_so_and_writes_nothing(tmp_path):
    command = [sys.executable, str(SCRIPT), "--out", str(tmp_path)]
    hidden = {**os.environ, "CUDA_VISIBLE_DEVICES": ""}
    done = subprocess.run(command, capture_output=True, text=True, env=hidden, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "torch finds no GPU here" in done.stdout
    assert list(tmp_path.iterdir()) == []
