"""Virtual environments of the peers, whose requirements contradict one another, and this project's.

Each has the peer and what it needs beside this project's own packages, which it sees through a path file: all run the
same torch. Packages are installed without their dependencies, because mosaicml-streaming and litdata ask for a
torchvision that brings another torch, and neither needs it to read arrays; what they import is listed here instead.
"""

import importlib.util
import subprocess
import sys
import venv
from pathlib import Path

PACKAGES = {
    "streaming": (
        "mosaicml-streaming==0.13.0",
        "brotli==1.2.1",
        "catalogue==2.0.10",
        "cramjam==2.14.0",
        "huggingface-hub==0.36.2",
        "numpy==2.1.3",
        "python-snappy==0.7.3",
        "tokenizers==0.22.2",
        "torchvision==0.15.2",  # the newest that can be imported beside a torch it was not built for
        "transformers==4.57.6",
        "xxhash==3.8.2",
        "zstd==1.5.7.2",
    ),
    "litdata": ("litdata==0.2.76", "lightning-utilities==0.15.3", "obstore==0.12.1", "tifffile==2026.3.3"),
    "energon": (
        "megatron-energon==7.4.1",
        "bracex==3.2.2",
        "deprecation==2.1.0",
        "filetype==1.2.0",
        "lark==1.3.1",
        "mfusepy==3.1.1",
        "multi-storage-client==1.3.1",
        "opentelemetry-api==1.45.2",
        "prettytable==3.18.0",
        "pyroute2==0.9.7",
        "rapidyaml==0.15.2",
        "tzdata==2025.3",
        "wcmatch==10.2.1",
        "wcwidth==0.9.4",
        "xattr==1.3.0",
    ),
}
"""What each environment adds to this project's packages; the first is the peer."""


def interpreter(folder: Path, name: str) -> Path:
    """The interpreter for a contestant: that of its environment, made on first use, or ours where it needs none."""
    if name not in PACKAGES:
        return Path(sys.executable)
    home = folder / name
    python = home / "bin" / "python"
    stamp = home / "packages.txt"
    wanted = "\n".join(PACKAGES[name])
    if not stamp.exists() or stamp.read_text() != wanted:
        print(f"making the environment of {PACKAGES[name][0]}", file=sys.stderr)
        venv.create(home, clear=True, symlinks=True, with_pip=False)
        [packages] = (home / "lib").glob("python*/site-packages")
        (packages / "project.pth").write_text(f"{_our_packages()}\n")
        pip = [sys.executable, "-m", "pip", "--python", str(python), "-qq", "--disable-pip-version-check"]
        subprocess.run([*pip, "install", "--no-deps", "--no-compile", *PACKAGES[name]], check=True, stdout=sys.stderr)
        stamp.write_text(wanted)
    return python


def _our_packages() -> Path:
    """The folder that torch is installed in."""
    spec = importlib.util.find_spec("torch")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("torch must be installed beside this project")
    return Path(spec.origin).parents[1]
