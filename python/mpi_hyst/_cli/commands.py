"""The command group; errors and interrupts end with one line and an exit status."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NoReturn

import click
from mpi_hyst_command.interrupted import NOTHING_WRITTEN, STATUS

import mpi_hyst
from mpi_hyst._cli.axes import axes
from mpi_hyst._cli.demo import demo
from mpi_hyst._cli.excite import excite
from mpi_hyst._cli.export import export
from mpi_hyst._cli.identify import identify
from mpi_hyst._cli.look import look
from mpi_hyst._cli.outputs import interrupts_restored
from mpi_hyst._cli.places import places
from mpi_hyst._cli.precompensate import precompensate
from mpi_hyst._cli.realtime import realtime
from mpi_hyst._cli.reproduce import reproduce
from mpi_hyst._cli.simulate import simulate
from mpi_hyst._cli.terminal import CommandError, keep_arguments, one_line, short_line
from mpi_hyst.io import ReadError

_WRONG = 2


class _Commands(click.Group):
    """A group that reports every error as one line on standard error, with exit status 2."""

    def main(
        self, args: Sequence[str] | None = None, prog_name: str | None = None, *_: Any, **extra: Any
    ) -> NoReturn:
        extra["standalone_mode"] = False
        with interrupts_restored(ends_process=extra.pop("ends_process", False)):
            try:
                status = super().main(args, prog_name, **extra)
            except click.Abort:
                _end(NOTHING_WRITTEN, STATUS)
            except click.ClickException as error:
                _end(short_line(error.format_message()), _WRONG)
            except (CommandError, ReadError, OSError) as error:
                _end(one_line(error), _WRONG)
            except MemoryError:
                _end("out of memory", _WRONG)
        sys.exit(status if isinstance(status, int) else 0)

    def make_context(
        self, info_name: str | None, args: list[str], *others: Any, **extra: Any
    ) -> click.Context:
        given = list(args)  # click takes them away one by one
        context = super().make_context(info_name, args, *others, **extra)
        keep_arguments(context, given)
        return context


def _end(message: str, status: int) -> NoReturn:
    with suppress(OSError):
        click.echo(f"mpi-hyst: error: {message}", err=True)
    sys.exit(status)


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(mpi_hyst.__version__, prog_name="mpi-hyst")
@click.pass_context
def commands(context: click.Context) -> None:
    """Identify the hysteresis of piezo actuators and compensate it with the exact inverse."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


for command in (
    look,
    excite,
    identify,
    places,
    axes,
    precompensate,
    simulate,
    export,
    realtime,
    demo,
    reproduce,
):
    commands.add_command(command)
