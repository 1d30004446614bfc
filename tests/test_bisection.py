"""Bisection against thresholds that are known."""

import pytest

from planner.bisection import bisect


@pytest.mark.parametrize(("good", "bad"), [(4.0, 1.0), (0.0, 3.0)])
@pytest.mark.parametrize("geometric", [False, True])
def test_it_ends_on_the_good_side_of_the_threshold(good, bad, geometric):
    def works(x):
        return (x >= 2.5) if good > bad else (x <= 2.5)

    start = max(good, 1e-3)
    found = bisect(works, start, bad, geometric=geometric)
    assert works(found)
    assert found == pytest.approx(2.5, rel=1e-12)


def test_it_stops_when_near_enough_or_after_its_steps():
    tried = []

    def works(x):
        tried.append(x)
        return x < 0.3

    assert bisect(works, 0.0, 1.0, steps=2) == 0.25
    assert tried == [0.5, 0.25]
    assert abs(bisect(works, 0.0, 1.0, within=0.01) - 0.3) < 0.01
    assert bisect(lambda _: False, 7.0, 1.0) == 7.0
