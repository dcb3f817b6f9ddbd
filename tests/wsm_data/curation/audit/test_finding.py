from wsm_data.curation.audit.finding import AuditFinding, Check, Severity, worst_first


def finding(check, severity, *clips):
    return AuditFinding(check=check, severity=severity, clips=clips, message="m")


def test_errors_come_first_and_then_the_order_of_the_checks():
    info = finding(Check.SCENE_IN_SPLITS, Severity.INFO, "a")
    warning = finding(Check.MAP_CONFLICT, Severity.WARNING, "a")
    second, first = finding(Check.CONTENT_TWICE, Severity.ERROR, "b"), finding(Check.CONTENT_TWICE, Severity.ERROR, "a")
    assert worst_first([info, warning, second, first]) == [first, second, warning, info]


def test_severities_are_ranked_from_mild_to_bad():
    assert [one.rank for one in (Severity.INFO, Severity.WARNING, Severity.ERROR)] == [0, 1, 2]
