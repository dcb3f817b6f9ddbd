"""What the workers' server loads is what workers need: tested in a process in which nothing was used before."""

import subprocess
import sys

PROGRAM = """
import sys
from pathlib import Path

import pipelines.warm_start
from box_room import MANIFEST_TOML, along_x, scene_files, write_folder
from numba.core.dispatcher import Dispatcher
from wsm_data.clips.config import ClipConfig
from pipelines.registry import load_stage
from pipelines.running.options import RunOptions
from pipelines.running.runner import run_stage
from pipelines.stages.encode import EncodeConfig
from pipelines.stages.index import IndexConfig
from pipelines.stages.map import MapConfig


def loaded():
    kernels = {
        f"{kernel.py_func.__module__}.{kernel.py_func.__name__}": [str(one) for one in kernel.signatures]
        for name, module in list(sys.modules.items())
        if name.startswith(("pipelines", "wsm_data"))
        for kernel in vars(module).values()
        if isinstance(kernel, Dispatcher)
    }
    return {f"{name}{one}" for name, signatures in kernels.items() for one in signatures}


root = Path(sys.argv[1])
(root / "box.toml").write_text(MANIFEST_TOML)
write_folder(root / "source/box_d435i/hall", scene_files({0: along_x()}))
write_folder(root / "source/box_d435i/den", scene_files({0: along_x(y_m=2.4)}, cloud=False))
before = loaded()
configs = {
    "index": IndexConfig(source=root / "source", dataset=str(root / "box.toml"), depth_sample_every=2),
    "map": MapConfig(index=root / "index"),
    "encode": EncodeConfig(index=root / "index", map=root / "map", clip=ClipConfig(width=64, height=32)),
}
for name, config in configs.items():
    report = run_stage(load_stage(name), config, root / name, RunOptions(quiet=True))
    assert report.done == 2, (name, report)
print("BEFORE", len(before), "MISSING", sorted(loaded() - before))
"""


def test_no_kernel_of_the_way_from_a_source_to_clips_is_loaded_later(tmp_path, fakes_on_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, program, tmp_path], env=fakes_on_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    before, _, missing = done.stdout.partition("MISSING")
    assert int(before.split()[1]) >= 10
    assert missing.strip() == "[]"
