"""The demo, for the terminal and as a page."""
