"""What every benchmark writes: numbers as JSON, a page to read, and the machine they were taken on."""

import json
import os
import platform
from importlib.metadata import version
from pathlib import Path

RESULTS = Path(__file__).parent / "results"


def machine(*packages: str) -> dict[str, object]:
    """Processor, cores and the versions of the packages that took part."""
    cpu_info = Path("/proc/cpuinfo")
    lines = cpu_info.read_text().splitlines() if cpu_info.is_file() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        **{package: version(package) for package in packages},
    }


def write_results(name: str, record: dict[str, object], lines: list[str], folder: Path = RESULTS) -> None:
    """Write results/<name>.json and results/<name>.md, and show the page."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n")
    page = "\n".join(lines) + "\n"
    (folder / f"{name}.md").write_text(page)
    print(page)


def table(header: list[str], rows: list[list[str]]) -> list[str]:
    """Lines of a markdown table."""
    return [f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows)]


def machine_line(record: dict[str, object]) -> str:
    """The machine in one sentence."""
    return ", ".join(f"{name} {value}" for name, value in record.items()) + "."
