"""The figure of a record that nobody has fitted yet."""
