"""Measured motions: logs, the derivatives that they lack, and their comparison with a plan."""
