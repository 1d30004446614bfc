"""A trial of forty plots of 1.2 by 3.6 m."""

import numpy as np

from planner.field.earth import geodetic_of
from planner.field.plots import lay_out
from tests.field.motions import SASKATOON

TRIAL = """
name = "forty plots"
basis = "assumed"
source = "a test"
rows = 10
ranges = 4
plot_m = [1.2, 3.6]
alley_m = [0.3, 1.5]
height_m = 480.0
corners = {corners}
"""
ACROSS, ALONG = 10 * 1.2 + 9 * 0.3, 4 * 3.6 + 3 * 1.5


def corners(count=4, angle=0.4, side=1.0):
    """Latitude and longitude of the trial's corners [rad]."""
    flat = np.array([[0.0, 0.0], [ALONG, 0.0], [ALONG, side * ACROSS], [0.0, side * ACROSS]])[:count]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ecef = SASKATOON.ecef(np.column_stack([flat @ turn.T, np.zeros(count)]))
    return np.column_stack(geodetic_of(ecef)[:2])


def trial(count=4, **given):
    """The map, and how far its corners are from the layout [m]."""
    return lay_out(corners(count, **given), 10, 4, (1.2, 3.6), (0.3, 1.5), height=480.0)
