"""The entry point of `mpi-hyst`: Ctrl-C while Python imports the command ends it with one line.

It stands beside the package `mpi_hyst`, because all that is in the package can only be imported
behind the package itself and numpy: a fifth of a second in which Ctrl-C would be a traceback.
"""

NOTHING_WRITTEN = "interrupted, nothing written"
STATUS = 130


def main() -> None:
    """Import the command line and run it."""
    try:
        import signal

        # Where Ctrl-C is ignored, as in the background, it stays so.
        is_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if is_default:
            # Not as an exception: imports have places where Python drops one and goes on.
            signal.signal(signal.SIGINT, _end)
        from mpi_hyst._cli.__main__ import imported

        commands = imported()
        if is_default:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        commands.main(prog_name="mpi-hyst", ends_process=True)
    except KeyboardInterrupt:
        _end()


def _end(*_: object) -> None:
    """End the process at once; nothing has been done yet."""
    import os

    try:
        os.write(2, f"mpi-hyst: error: {NOTHING_WRITTEN}\n".encode())
    finally:
        os._exit(STATUS)
