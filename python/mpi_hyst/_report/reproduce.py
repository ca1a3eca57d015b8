"""The reproduction of the paper, for the terminal and as a page: published, reproduced, better."""

from __future__ import annotations

from collections.abc import Sequence

from mpi_hyst._paper import published, schemes
from mpi_hyst._paper.benchmark import PLANTS, median, mismatch_percent, whole_sine
from mpi_hyst._paper.published import WALK_OUTPUT, Comparison, single
from mpi_hyst._paper.reproduction import WALK_INPUT, Models, Reproduction
from mpi_hyst._paper.schemes import MOTIONS, Outcome, Saturation
from mpi_hyst._report import coupled_play
from mpi_hyst._report import reproduce_figures as figures
from mpi_hyst._report.page import Card, Provenance, Rows, render
from mpi_hyst._text import digits
from mpi_hyst.paper import gains

PUBLISHED_LAW = ("published law: Table II + P-I", "-")
FULL = "exact inverse, inverse dynamics + same P-I"


def report(made: Reproduction, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    trials = {name: [one for one in made.trials if one.plant == name] for name in PLANTS}
    beyond = scheme_rows(made.outcomes)
    return render(
        "reproduce.html.j2",
        cards=_cards(made),
        provenance=provenance,
        made=made,
        published=published,
        schemes=schemes,
        mismatch=mismatch_percent(),
        summary=summary_rows(made),
        table_1=table_1_rows(made.models),
        table_2=table_2_rows(made.models),
        hysteresis=figures.loop(made.models),
        operators=figures.operators(),
        walk=coupled_play.walk(),
        corners=walk_rows(made.models),
        fits=figures.fits(made.models),
        identified=identified_rows(made.models),
        plants=[(name, gains(name), figures.errors(trials[name])) for name in PLANTS],
        tracks=figures.tracks(trials[PLANTS[0]]),
        simulated=compared_rows([one for one in made.comparisons if one.plant]),
        beyond=beyond,
        best_scheme=[i for i, row in enumerate(beyond[1]) if row[:2] == [FULL, "exact"]],
        over_frequency=figures.over_frequency(made.outcomes),
        in_time=figures.in_time(schemes.example(whole_sine(20.0)), "20 Hz"),
        saturated_laws=figures.saturated_laws(made.saturation),
        saturated=saturation_rows(made.saturation),
        compared=compared_rows(made.comparisons),
        not_comparable=compared_rows(made.not_comparable),
    )


def _cards(made: Reproduction) -> list[Card]:
    sines = [
        abs(one.deviation_percent or 0.0)
        for one in made.comparisons
        if one.figure in ("Fig. 14", "Fig. 15", "Fig. 16", "Fig. 17")
    ]
    paper, full = made.outcome(*PUBLISHED_LAW), made.outcome(FULL, "exact")
    learned = made.outcome("repetitive control, 3 s", "wrong model and dynamics")
    largest = [1e3 * outcome.errors["20 Hz"].max for outcome in (paper, full, learned)]
    return [
        Card(
            f"{max(sines):.1f} %",
            "largest deviation from a published maximum",
            "sines, plants A1 and P3",
        ),
        Card(f"{largest[0]:.0f} nm", "published law at 20 Hz", "true position, plant A1"),
        Card(f"{largest[1]:.1f} nm", "exact inverse and inverse dynamics", "the same, exact model"),
        Card(f"{largest[2]:.1f} nm", "repetitive control", "the same, wrong model and dynamics"),
    ]


def compared_rows(comparisons: Sequence[Comparison]) -> Rows:
    """Return published and own numbers with their deviation."""
    header = ["what", "paper", "ours", "unit", "deviation"]
    rows = [
        [
            f"{', '.join(filter(None, (one.figure, one.plant)))}: {one.what}",
            one.published_text,
            digits(one.ours, 3),
            one.unit,
            one.deviation_text,
        ]
        for one in comparisons
    ]
    return header, rows


def scheme_rows(outcomes: Sequence[Outcome]) -> Rows:
    """Return the largest and rms true error of every scheme for every motion, in nm."""
    header = ["scheme", "assumed", *(motion.name for motion in MOTIONS)]
    rows = []
    for outcome in outcomes:
        cells = [
            f"{_nanometres(error.max)} ({_nanometres(error.rms)})"
            for error in (outcome.errors[motion.name] for motion in MOTIONS)
        ]
        rows.append([outcome.name, outcome.assumed, *cells])
    return header, rows


def _nanometres(micrometres: float) -> str:
    value = 1e3 * micrometres
    return f"{value:.0f}" if value >= 99.95 else f"{value:.1f}"


def saturation_rows(cases: Sequence[Saturation]) -> Rows:
    """Return when a law reaches a limit, for how long, and its errors afterwards."""
    header = ["law", "first at limit", "at limit", "max (nm)", "rms (nm)"]
    rows = [
        [
            f"{case.name}, {case.law}",
            f"sample {case.first}",
            f"{case.samples} of {len(case.shown)}",
            _nanometres(case.max_error),
            _nanometres(case.rmse),
        ]
        for case in cases
    ]
    return header, rows


def summary_rows(made: Reproduction) -> Rows:
    """Return published, reproduced and improved errors for each motion of the paper."""
    header = [
        "motion",
        "paper",
        "A1",
        "P3",
        "published law on A1",
        "exact model",
        "wrong model and dynamics",
    ]
    header += ["repetitive"]
    chosen = [
        made.outcome(*PUBLISHED_LAW),
        made.outcome(FULL, "exact"),
        made.outcome(FULL, "wrong model and dynamics"),
        made.outcome("repetitive control, 3 s", "wrong model and dynamics"),
    ]
    rows = []
    for figure in [f"Fig. {number}" for number in range(13, 18)]:
        pair = [trial for trial in made.trials if trial.figure == figure]
        numbers = " to ".join(f"{1e3 * one:.0f}" for one in dict.fromkeys(pair[0].published))
        name = pair[0].motion.name
        rows.append(
            [
                name,
                numbers,
                *(f"{1e3 * median(trial.maxima):.0f}" for trial in pair),
                *(_nanometres(outcome.errors[name].max) for outcome in chosen),
            ]
        )
    return header, rows


def table_1_rows(models: Models) -> Rows:
    """Return Table I as printed, as recovered from Table II, and as identified here."""
    header = ["i", "r (V)", "printed w", "recovered w", "difference", "identified w"]
    printed, recovered = models.printed[0], models.computed[0]
    identified = models.fits[0].model
    return header, [
        [
            str(index),
            f"{printed.r[index]:g}",
            f"{printed.weights[index]:.4f}",
            f"{recovered.weights[index]:.4e}",
            f"{recovered.weights[index] - printed.weights[index]:+.1e}",
            f"{identified.weights[index]:.4e}",
        ]
        for index in range(printed.operators)
    ]


def table_2_rows(models: Models) -> Rows:
    """Return Table II as printed and as computed."""
    header = ["i", "printed w'", "computed w'", "printed r'", "computed r'", "largest difference"]
    printed, computed = models.printed[1], models.computed[1]
    columns = ("weights", "r", "ra", "rb", "rc")
    rows = []
    for index in range(printed.operators):
        off = (abs(getattr(printed, c)[index] - getattr(computed, c)[index]) for c in columns)
        rows.append(
            [
                str(index),
                f"{printed.weights[index]:.4f}",
                f"{computed.weights[index]:.6f}",
                f"{printed.r[index]:.4f}",
                f"{computed.r[index]:.6f}",
                f"{max(off):.1e}",
            ]
        )
    return header, rows


def identified_rows(models: Models) -> Rows:
    """Return the errors of the models of Fig. 8 to 10, with their bases."""
    header = [
        "figure",
        "model",
        "paper max (%)",
        "max (%)",
        "paper MSE",
        "MSE (µm²)",
        "true max (%)",
    ]
    rows = []
    for fit, largest, mse in zip(models.fits, *_printed_numbers(models.comparisons), strict=True):
        rows.append(
            [
                fit.figure,
                fit.name,
                largest,
                f"{fit.max_percent:.2f}",
                mse,
                f"{fit.mse:.2e}",
                f"{fit.true_max_percent:.2f}",
            ]
        )
    return header, rows


def _printed_numbers(comparisons: Sequence[Comparison]) -> tuple[list[str], list[str]]:
    of_fits = [one for one in comparisons if one.figure in ("Fig. 8", "Fig. 9, 10")]
    largest = [one.published_text for one in of_fits if one.unit.startswith("%")]
    return largest, [one.published_text for one in of_fits if one.unit == "µm²"]


def walk_rows(models: Models) -> Rows:
    """Return the corners of the walk of Fig. 5."""
    triples = list(zip(WALK_INPUT, WALK_OUTPUT, models.walk, strict=True))
    header = ["x (V)", *(f"{x:g}" for x, _, _ in triples)]
    return header, [
        ["paper z (V)", *(f"{z:g}" for _, z, _ in triples)],
        ["ours z (V)", *(f"{z:g}" for _, _, z in triples)],
        [
            "deviation",
            *(Comparison("", "", "", single(z), o).deviation_text for _, z, o in triples),
        ],
    ]
