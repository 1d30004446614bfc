"""Missions: duty cycles of moves, holds and pauses."""
