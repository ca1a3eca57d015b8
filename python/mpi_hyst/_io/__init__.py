"""Reads records: a file for each family of formats, and `formats.py`, which lists them all."""
