"""Dynamics of the boom: inverse dynamics, equations of motion and the base's motion."""
