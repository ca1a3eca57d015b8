"""The reproduction of the paper, for the terminal and as a page."""
