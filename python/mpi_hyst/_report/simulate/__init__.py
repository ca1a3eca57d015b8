"""A simulated run, for the terminal and as a page."""
