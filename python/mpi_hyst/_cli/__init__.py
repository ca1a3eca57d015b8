"""The command line: a room for each command, and what they share."""
