"""Motions: sampled trajectories, their files, and the motion of the vehicle."""
