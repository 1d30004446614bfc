"""The answer of a report: its findings begin with the worst."""

from boom_model import Boom
from planner import plan
from planner.checks.rows import Verdict
from planner.reports.answer import answer


def test_the_check_that_fails_by_most_comes_first():
    report = plan(Boom.load().with_payload(25.0), "transport", "phenotyping").report
    failed = {row.check: row.demand / row.limit for row in report.rows if row.verdict is Verdict.FAIL}
    worst_first = sorted(failed, key=lambda check: -failed[check])
    assert len(worst_first) > 1
    assert worst_first != sorted(worst_first)
    told = [finding.split(": ")[0] for finding in answer(report).findings if finding.startswith("FAIL")]
    assert told == [f"FAIL {check}" for check in worst_first]
