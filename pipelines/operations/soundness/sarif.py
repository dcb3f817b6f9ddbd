"""Findings as SARIF 2.1.0 (OASIS), which code scanning and editors read."""

from collections.abc import Sequence
from importlib.metadata import version
from urllib.parse import quote

from wsm_data.files.digest import digest_json
from wsm_data.schema.verdict import Refusal

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"


def sarif_log(new: Sequence[Refusal], known: Sequence[Refusal], tool: str) -> dict[str, object]:
    """A log of one run: a rule a reason code, a result a finding; known ones are suppressed from outside.

    Args:
        new: findings.
        known: those that stand in a baseline.
        tool: the command.
    """
    codes = sorted({str(one.reason) for one in (*new, *known)})
    results = [*(_result(one, codes) for one in new), *({**_result(one, codes), **_SUPPRESSED} for one in known)]
    driver = {"name": tool, "version": version("wsm"), "rules": [{"id": code} for code in codes]}
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


_SUPPRESSED = {"suppressions": [{"kind": "external"}]}


def _result(finding: Refusal, codes: Sequence[str]) -> dict[str, object]:
    """Line 1 is named since GitHub shows no result without a region; a unit is no text file."""
    place = {
        "physicalLocation": {
            "artifactLocation": {"uri": quote(finding.source), "uriBaseId": "SOURCE"},
            "region": {"startLine": 1},
        },
        "logicalLocations": [{"fullyQualifiedName": finding.unit}],
    }
    return {
        "ruleId": str(finding.reason),
        "ruleIndex": codes.index(str(finding.reason)),
        "level": "error",
        "message": {"text": finding.message},
        "locations": [place],
        "partialFingerprints": {"unitAndCode/v1": digest_json([str(finding.reason), finding.unit])},
        "properties": finding.details,
    }
