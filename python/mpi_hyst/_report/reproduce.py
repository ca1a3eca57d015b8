"""The reproduction of the paper, for the terminal and as a page: published, reproduced, better."""

from __future__ import annotations

from collections.abc import Sequence

from mpi_hyst._paper import published, schemes
from mpi_hyst._paper.benchmark import PLANTS, median, mismatch_percent, whole_sine
from mpi_hyst._paper.published import WALK_OUTPUT, Comparison, single
from mpi_hyst._paper.reproduction import WALK_INPUT, Models, Reproduction
from mpi_hyst._paper.schemes import MOTIONS, Outcome, Saturation
from mpi_hyst._report import canvas, coupled_play
from mpi_hyst._report import reproduce_figures as figures
from mpi_hyst._report.page import Card, Figure, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._text import digits
from mpi_hyst.paper import gains

_TRUE = "Error of the true position in nm, median over the seeds."


def report(made: Reproduction, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    return render(
        Report(
            title="Published, reproduced, improved",
            subtitle="The tables and figures of Wang, Chen, Zhou and Bai (2017), recomputed",
            cards=_cards(made),
            sections=[
                _summary(made),
                _tables(made),
                _operators(made),
                _identification(made),
                _loops(made),
                _beyond(made),
                _saturation(made),
                _numbers(made),
            ],
            provenance=provenance,
            footer=f"{published.PAPER}. Medians over {made.seeds} seeds.",
        )
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


def _figure(drawn: canvas.Figure, alternative: str, caption: str) -> Figure:
    return Figure(canvas.data_uri(drawn), alternative, caption)


def _table(caption: str, rows: Rows, note: str = "", best: tuple[int, ...] = ()) -> Table:
    return Table(caption, *rows, note=note, best=best)


def _summary(made: Reproduction) -> Section:
    note = (
        "paper, A1, P3: largest measured error over three periods, noise included. Other columns: "
        "true position on A1 with 16 nm rms of noise, after the first period or 3 s of learning. "
        "Exact model, wrong model and dynamics, repetitive: exact inverse, inverse dynamics and "
        f"the published gains. Wrong: the model by {mismatch_percent():.2f} % of the range, the "
        "natural frequency by 5 %, the damping ratio by 20 %."
    )
    table = _table("Largest errors, nm", summary_rows(made), note)
    return Section("summary", "Published, reproduced, improved", published.CAVEATS, [table])


def _tables(made: Reproduction) -> Section:
    text = [
        "Table I has four decimals, which makes errors of the weights of up to 31 %. Table II is "
        "the closed-form inverse of the same weights with four more digits. Inverting it again "
        "recovers the weights. All 20 round to Table I, and their inverse rounds to Table II.",
    ]
    note = "identified: without Table I, from the record of Fig. 8 with 16 nm rms of noise"
    blocks = [
        _table("Table I: weights of the actuator, µm/V", table_1_rows(made.models), note),
        _table(
            "Table II: its parametric inverse, V/µm and µm",
            table_2_rows(made.models),
            "largest difference: of w', r', ra', rb', rc'",
        ),
    ]
    return Section("tables", "Tables I and II", text, blocks)


def _operators(made: Reproduction) -> Section:
    corners = walk_rows(made.models)
    return Section(
        "operators",
        "Fig. 1, 4, 5: hysteresis and operators",
        ["The paper gives no numbers for Fig. 1 and 4. Those of Fig. 5 are reproduced exactly."],
        [
            _figure(
                figures.loop(made.models),
                "Displacement over drive, and the same minus the straight line",
                "Fig. 1: the actuator under a decaying triangle of ±500 V. It reaches "
                f"{made.models.position.max():+.4f} and {made.models.position.min():+.4f} µm.",
            ),
            _figure(
                figures.operators(),
                "Output over input of a play and of a coupled play",
                "Fig. 4: a coupled play stops at zero. Its thresholds differ above and below zero.",
            ),
            _figure(
                coupled_play.walk(),
                "The walk of Fig. 5: output over input, and both over the distance travelled",
                "Fig. 5: thresholds r 10, ra 8, rb 3, rc 4 V.",
            ),
            _table("Fig. 5: corners of the walk", corners),
        ],
    )


def _identification(made: Reproduction) -> Section:
    return Section(
        "identification",
        "Fig. 8, 9, 10: identification",
        [
            published.UNPUBLISHED_DATA,
            "Here the record is a triangle that decays from ±500 V in ten cycles, on the actuator "
            "of the tables with 16 nm rms of sensor noise. Both models are fitted to it.",
        ],
        [
            _figure(
                figures.fits(made.models),
                "The record, both models, and the errors of three models over time",
                "The error of the modified model is noise. The errors of the conventional models "
                "have the shape of the loops.",
            ),
            _table(
                "Errors against the record",
                identified_rows(made.models),
                "max (%): of the range of the record. true: against the position without noise. "
                "The bases of the published percentages are not given.",
            ),
        ],
    )


def _loops(made: Reproduction) -> Section:
    blocks: list[Figure | Table] = []
    for plant in PLANTS:
        trials = [trial for trial in made.trials if trial.plant == plant]
        kp, ki = gains(plant)
        blocks.append(
            _figure(
                figures.errors(trials),
                f"Errors over time on plant {plant}",
                f"Fig. 12 to 17 on plant {plant}, kp {kp:g} V/µm, ki {ki:g} V/µm/s: the "
                "run whose largest error is closest to the median.",
            )
        )
    shown = [trial for trial in made.trials if trial.plant == PLANTS[0]]
    blocks.insert(
        1,
        _figure(
            figures.tracks(shown),
            "Reference and position over time",
            "The same runs: reference and position. At this scale the two lines nearly coincide.",
        ),
    )
    numbers = [one for one in made.comparisons if one.plant]
    blocks.append(_table("Published and simulated", compared_rows(numbers), published.BASES))
    return Section(
        "loops",
        "Fig. 12 to 17: the published law in closed loop",
        [
            "Fig. 12 inverts the conventional model of the same weights. All others use Table II. "
            "Each run has three periods from rest, at 10 kHz.",
            published.NO_PROOF,
        ],
        blocks,
    )


def _beyond(made: Reproduction) -> Section:
    rows = scheme_rows(made.outcomes)
    best = tuple(i for i, row in enumerate(rows[1]) if row[:2] == [FULL, "exact"])
    note = (
        f"{_TRUE} max (rms) over one second: after the first period, after three periods "
        f"(iterative learning) or 3 s (repetitive control, adaptation). Learning bandwidth "
        f"{schemes.BANDWIDTH:g} Hz. 15 Hz is 10 kHz / 667. assumed: the model and dynamics that "
        "the controller uses. Wrong model: weights times 1.5 and 0.5 in turn, an open-loop error "
        f"of {mismatch_percent():.2f} % of the range. Wrong dynamics: natural frequency +5 %, "
        "damping ratio -20 %. With the exact model the error is sensor noise through the feedback; "
        "the first bound is the error without noise."
    )
    return Section(
        "beyond",
        "Beyond the paper",
        [
            "The error of the published law is lag. An exact inverse of the hysteresis does not "
            "change that. If the reference also passes through the inverse dynamics, half a sample "
            "early, the same gains leave only the sensor noise that the feedback passes on.",
            "A wrong model or wrong dynamics increase the error again. Learning removes it where "
            "the motion repeats. Adaptation of the model removes part of it for any motion. Higher "
            "gains do so too, but pass on more noise. At 100 Hz, near the learning bandwidth of "
            f"{schemes.BANDWIDTH:g} Hz, learning removes only a part.",
            "An observer reduces the noise in the feedback if the model is right. It cannot "
            "correct a wrong model or wrong dynamics.",
        ],
        [
            _table("Schemes on plant A1 with 16 nm rms of sensor noise", rows, note, best),
            _figure(
                figures.over_frequency(made.outcomes),
                "Largest true error over frequency for seven schemes",
                f"{_TRUE} Stars: published maxima of the measured error, noise included.",
            ),
            _figure(
                figures.in_time(schemes.example(whole_sine(20.0)), "20 Hz"),
                "Errors over time at 20 Hz with the published law and with inverse dynamics",
                "At the start the controller changes over from rest to the motion without a jump.",
            ),
        ],
    )


def _saturation(made: Reproduction) -> Section:
    rows = saturation_rows(made.saturation)
    low, high = schemes.DRIVE_LIMITS
    return Section(
        "saturation",
        "Saturation",
        [
            f"A triangle of 3.3 µm at 1 Hz needs about 530 V. Here the drive is limited to {low:g} "
            f"to {high:g} V, which reaches 3.06 µm.",
            "The law as printed adds the whole feed-forward at every sample and stays at the "
            "limit. The incremental law adds differences; it loses what the limit cuts off.",
        ],
        [
            _figure(
                figures.saturated_laws(made.saturation),
                "Position, drive and error over time for four laws",
                f"Table II + P-I. On grey the reference is beyond {schemes.REACHED:g} µm.",
            ),
            _table(
                "Errors after saturation",
                rows,
                f"{_TRUE} Counted where the reference is within {schemes.REACHED:g} µm, after "
                "the first sample at a limit.",
            ),
        ],
    )


def _numbers(made: Reproduction) -> Section:
    return Section(
        "numbers",
        "All numbers",
        ["Deviation: from the published number, or from the nearer of two. within: between two."],
        [
            _table("All published numbers that can be compared", compared_rows(made.comparisons)),
            _table(
                "Not comparable: average hysteresis",
                compared_rows(made.not_comparable),
                published.BASES,
            ),
        ],
    )


Rows = tuple[list[str], list[list[str]]]

PUBLISHED_LAW = ("published law: Table II + P-I", "-")
FULL = "exact inverse, inverse dynamics + same P-I"


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
