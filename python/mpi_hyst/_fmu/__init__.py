"""Functional mock-up units: how they are packed, and in `binaries` the library in them."""
