"""How a command ends that Ctrl-C stops: what it says, and its exit status."""

NOTHING_WRITTEN = "interrupted, nothing written"
STATUS = 130
