"""Limit checks of a motion, its certificate, and the worst stop on its way."""
