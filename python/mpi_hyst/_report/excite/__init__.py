"""A designed drive, for the terminal and as a page."""
