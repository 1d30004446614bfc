"""Timing of paths: profiles, time laws, and their limits."""
