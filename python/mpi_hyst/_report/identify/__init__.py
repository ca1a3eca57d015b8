"""The result of an identification, for the terminal and as a page."""
