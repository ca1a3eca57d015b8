"""The paper recomputed: its actuator, its figures, the demo, and schemes beyond it."""
