"""Closed-loop simulation: plant with elastic drives, controllers, and tracking error of the tip."""

from planner.control.closed_loop import Case, Command, Gust, Run, parse_gust, simulate
from planner.control.design import Controller, Gains, Goals, Loop, Margins, analyse, design
from planner.control.figures import Figures, parse_figures
from planner.control.linear import Linear, linearise
from planner.control.plant import Plant, natural_frequencies
from planner.control.shaping import Impulses, Shaper, impulses, residual
from planner.control.study import Outcome, Row, Setup, Study, study

__all__ = [
    "Case",
    "Command",
    "Controller",
    "Figures",
    "Gains",
    "Goals",
    "Gust",
    "Impulses",
    "Linear",
    "Loop",
    "Margins",
    "Outcome",
    "Plant",
    "Row",
    "Run",
    "Setup",
    "Shaper",
    "Study",
    "analyse",
    "design",
    "impulses",
    "linearise",
    "natural_frequencies",
    "parse_figures",
    "parse_gust",
    "residual",
    "simulate",
    "study",
]
