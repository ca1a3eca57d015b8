"""Computations on the actuator of the paper: demo, figures, further control schemes."""
