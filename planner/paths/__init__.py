"""Paths of a move: joint lines, splines through waypoints, and curves of the tip."""
