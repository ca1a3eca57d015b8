"""The entry point of `mpi-hyst`: Ctrl-C while Python imports the command ends it with one line.

It stands beside the package `mpi_hyst`, because all that is in the package can only be imported
after the package itself and numpy: until then Ctrl-C would be a traceback.
"""

from mpi_hyst_command.interrupted import NOTHING_WRITTEN, STATUS


def main() -> None:
    """Import the command line and run it."""
    try:
        import signal
        import threading

        # Where Ctrl-C is ignored, as in the background, it stays so.
        # Only the main thread may change that.
        is_default = (
            threading.current_thread() is threading.main_thread()
            and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        )
        if is_default:
            # Not as an exception: imports have places where Python drops one and goes on.
            signal.signal(signal.SIGINT, _end)
        from mpi_hyst._cli.__main__ import imported

        commands = imported()
        if is_default:
            signal.signal(signal.SIGINT, signal.default_int_handler)
    except KeyboardInterrupt:
        _end()
    # Behind the imports: a command may have written, and says itself how it ended.
    commands.main(prog_name="mpi-hyst", ends_process=True)


def _end(*_: object) -> None:
    """End the process at once; nothing has been done yet."""
    import os

    try:
        os.write(2, f"mpi-hyst: error: {NOTHING_WRITTEN}\n".encode())
    finally:
        os._exit(STATUS)
