import json

import pytest

from pipelines.operations.soundness.findings import FindingsReport, Telling, annotation, read_baseline, tell
from pipelines.operations.soundness.sarif import sarif_log
from wsm_data.errors import BudgetExceeded, ConfigError, Reason
from wsm_data.schema.verdict import Refusal


def finding(unit="a/b/0", reason=Reason.POSE_JUMP, **changes):
    values = {"source": "a/b c.tar.gz", "message": "it must not jump", "details": {"measured": {"max_step_m": 2.0}}}
    return Refusal(unit=unit, reason=reason, **{**values, **changes})


def report(*findings):
    return FindingsReport(source="root", dataset="synthetic", units=("a/b/0",), findings=findings)


def test_nothing_found_ends_well(capsys):
    tell(report(), Telling(), "wsm check")
    assert "1 units looked at, 0 findings" in capsys.readouterr().out


def test_a_finding_fails_and_what_was_printed_as_json_silences_it_and_no_other(tmp_path, capsys):
    with pytest.raises(BudgetExceeded, match="root: 1 findings in 1 units") as caught:
        tell(report(finding()), Telling(as_json=True), "wsm check")
    assert caught.value.exit_code == 3
    baseline = tmp_path / "baseline.json"
    baseline.write_text(capsys.readouterr().out)
    telling = Telling(as_json=True, baseline=baseline)
    tell(report(finding(message="other words", details={})), telling, "wsm check")
    said = json.loads(capsys.readouterr().out)
    assert (said["findings"], len(said["known"])) == ([], 1)
    baseline.write_text(json.dumps(said))  # a baseline that is made with a baseline holds the old findings
    assert read_baseline(baseline) == {("pose.jump", "a/b/0")}
    for other in (finding(unit="a/b/1"), finding(reason=Reason.MOUNT_MISFIT)):
        with pytest.raises(BudgetExceeded):
            tell(report(finding(), other), telling, "wsm check")


@pytest.mark.parametrize("text", ["", "[]", '{"findings": 3}', '{"findings": [{"unit": "a"}], "known": []}'])
def test_a_baseline_that_is_something_else_is_a_wrong_request(tmp_path, text):
    (tmp_path / "baseline.json").write_text(text)
    with pytest.raises(ConfigError, match="--baseline"):
        read_baseline(tmp_path / "baseline.json")


def test_sarif_has_a_rule_a_code_a_result_a_finding_and_suppresses_what_is_known():
    """What the standard requires of a result: 3.27 ruleId with ruleIndex into the driver's rules, message, location."""
    log = sarif_log([finding(), finding(unit="a/b/1")], [finding(reason=Reason.MOUNT_MISFIT)], "wsm check")
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == ["mount.misfit", "pose.jump"]
    assert [rules[one["ruleIndex"]] for one in run["results"]] == [one["ruleId"] for one in run["results"]]
    assert ["suppressions" in one for one in run["results"]] == [False, False, True]
    place = run["results"][0]["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "a/b%20c.tar.gz"
    prints = {one["partialFingerprints"]["unitAndCode/v1"] for one in run["results"]}
    assert len(prints) == 3


def test_an_annotation_is_one_line_whatever_a_name_holds():
    line = annotation(finding(source="a,b:c", message="100 % of\nthem"))
    assert line == "::error file=a%2Cb%3Ac,title=pose.jump::100 %25 of%0Athem"
