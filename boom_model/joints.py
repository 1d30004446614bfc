"""Names of the joints."""

JOINTS = ("yaw", "inner", "lower", "extension", "wrist")
"""Joint names, in the order of q: theta1 .. theta5 of the thesis."""
