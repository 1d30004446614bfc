"""Checks of gearbox, motor, brake, linear actuator and tip deflection."""
