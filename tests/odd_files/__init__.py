"""Odd inputs: records as benches leave them, and where what is said of them leads to."""
