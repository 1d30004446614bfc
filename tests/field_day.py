"""The shipped boom's field day, planned once for all tests that look at it."""

from functools import cache

from boom_model import Boom
from planner.missions.mission import Cycle, load_mission, plan_cycle


@cache
def field_day() -> Cycle:
    """Planned when it is first asked for: it takes seconds."""
    return plan_cycle(Boom.load(), load_mission("field-day"))
