"""Where a run stands as numbers for Prometheus, in its text format: a file that a node's exporter collects."""

from collections.abc import Iterable, Mapping

from pipelines.running.stage_status import RUNNING, StageStatus

_Labels = Mapping[str, str]


def prometheus_text(run: str, stages: Iterable[StageStatus]) -> str:
    """The stages as gauges, each labelled with its run and stage (exposition format 0.0.4).

    Counts go down where a unit is done again, so that none of them is a counter. What is not known is left out.
    """
    every = [(one, {"run": run, "stage": one.stage}) for one in stages]
    units = [
        ({**labels, "state": state}, float(count))
        for one, labels in every
        for state, count in (("done", one.done), ("refused", one.refused), ("pending", one.pending))
    ]
    refusals = [
        ({**labels, "reason": reason}, float(count))
        for one, labels in every
        for reason, count in sorted(one.refusals.items())
    ]
    return "".join(
        (
            _gauge("wsm_units", "Units of a stage by what became of them.", units),
            _gauge("wsm_refusals", "Refusals by reason, of units and of parts of units.", refusals),
            _gauge(
                "wsm_stage_running",
                "1 while a process of this machine writes the stage.",
                [(labels, float(one.state == RUNNING)) for one, labels in every],
            ),
            _gauge(
                "wsm_unit_seconds",
                "Seconds of all workers on the units of a stage.",
                [(labels, one.unit_seconds) for one, labels in every],
            ),
            _gauge(
                "wsm_units_per_second",
                "Units settled a second since the stage was last begun.",
                [(labels, one.per_s) for one, labels in every if one.per_s is not None],
            ),
            _gauge(
                "wsm_remaining_seconds",
                "Time for all that is pending at this rate.",
                [(labels, one.remaining_s) for one, labels in every if one.remaining_s is not None],
            ),
        )
    )


def _gauge(name: str, about: str, samples: Iterable[tuple[_Labels, float]]) -> str:
    lines = [f"{name}{{{_labels(labels)}}} {value:.10g}" for labels, value in samples]
    return "\n".join([f"# HELP {name} {about}", f"# TYPE {name} gauge", *lines]) + "\n"


def _labels(labels: _Labels) -> str:
    return ",".join(f'{name}="{_escaped(value)}"' for name, value in labels.items())


def _escaped(value: str) -> str:
    return value.replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n")
