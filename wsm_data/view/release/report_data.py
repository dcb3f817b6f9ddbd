"""What is known about a release beyond its own files, and handed to the report."""

from dataclasses import dataclass

from wsm_data.view.release.clip_survey import ClipSurvey


@dataclass(frozen=True, kw_only=True)
class StageSummary:
    """What one stage of the run that made a release did.

    Attributes:
        name: name of the stage.
        version: version of the stage.
        units: units of its inputs.
        done: units that are done.
        refused: units that are refused.
        pending: units without an outcome yet.
        seconds: time spent on its units, summed over workers, s.
        workers: worker processes of its last run.
        fingerprint: digest of name, version and settings.
    """

    name: str
    version: int
    units: int
    done: int
    refused: int
    pending: int = 0
    seconds: float
    workers: int
    fingerprint: str = ""

    @property
    def done_per_s(self) -> float | None:
        """Units done for each second spent on units, refused ones included; None where no time was measured."""
        return self.done / self.seconds if self.seconds else None


@dataclass(frozen=True, kw_only=True)
class ReportData:
    """Everything the report shows that is not in the release's manifest, index, inventory and quarantine.

    Attributes:
        survey: numbers and pictures of clips.
        stages: the stages in the order of the flow; empty when the folder of the run is not at hand.
    """

    survey: ClipSurvey
    stages: tuple[StageSummary, ...] = ()
