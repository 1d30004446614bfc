"""Choice of motors, gearboxes and actuators: the catalogue checked against a mission."""
