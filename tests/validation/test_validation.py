"""The thesis's tables."""

from collections import Counter
from dataclasses import replace

import pytest

from boom_model import Boom
from planner.validation.tables import validate

BOOM = Boom.load()


def test_every_row_holds():
    rows = validate(BOOM)
    assert [row for row in rows if not row.ok] == []
    counts = {"2-5": 20, "2-6": 33, "2-7": 40, "2-8": 55, "3-1": 16, "3-25": 2, "3-2": 10, "3-19": 2, "3-3": 3, "3.38": 1}
    assert Counter(row.table for row in rows) == counts


def test_known_slips_hold_the_corrected_value_and_say_so():
    corrected = [row for row in validate(BOOM) if "corrected" in row.note]
    assert len(corrected) == 13
    assert {row.quantity for row in corrected} == {"yaw [rad]", "tau1 [Nm]", "tip speed [m/s]"}


@pytest.mark.parametrize(
    ("change", "tables"),
    [
        ({"geometry": replace(BOOM.geometry, L6=0.0425)}, {"2-6", "2-7", "2-8", "3-1"}),
        ({"gravity": 9.8}, {"2-8", "3-1"}),
        ({"bodies": BOOM.bodies | {"upper": replace(BOOM.bodies["upper"], mass=2.978)}}, {"2-8", "3-25"}),
    ],
)
def test_a_slightly_wrong_model_breaks_rows(change, tables):
    assert {row.table for row in validate(replace(BOOM, **change)) if not row.ok} == tables
