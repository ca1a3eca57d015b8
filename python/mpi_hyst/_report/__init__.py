"""Reports: a room for each, and common parts."""
