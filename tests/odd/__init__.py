"""Odd inputs: records as they come from benches, what is said of them, and what following that leads to."""
