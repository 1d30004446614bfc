"""Drives of the joints: motor, gearbox and linear actuator with their datasheet values.

It also holds the catalogue of components and the compliance of the gearboxes.
"""
