"""What is said of an identification, in a terminal, a notebook and a page: verdict and numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpi_hyst._core import (
    Finding,
    FirstOrder,
    Identification,
    LeftOutLoop,
    ModifiedPrandtlIshlinskii,
    Quality,
)
from mpi_hyst._report.models import relaxing_plays
from mpi_hyst._report.page import MEANINGS, Rows, Verdict
from mpi_hyst._report.records import Evaluated, Records, Task, evaluate
from mpi_hyst._text import NOT_DETERMINED, determined, digits, in_unit, text_pairs, text_table

_CREEP = 1.0  # %: creep that is known to this is known to be small


def summary(task: Task, found: Identification, left_out: Sequence[LeftOutLoop]) -> str:
    """Return the verdict, the parameters, the errors and the warnings."""
    unit, of_unit = task.output.unit, task.output.in_parentheses
    header = [
        *("record", "samples", f"max{of_unit}", f"rms{of_unit}", "max (%)", "rms (%)"),
        *(f"range{of_unit}", f"offset{of_unit}"),
    ]
    fitted, held_out = evaluate(task.records, found)
    rows = _rows("", fitted, found.fit)
    if held_out and found.validation is not None:
        rows += _rows("held out: ", held_out, found.validation)
    base = "  %: of the range, the peak-to-peak of the measured output over these samples"
    if max(len(fitted), len(held_out)) > 1:
        base += "; all: of the largest range"
    parts = [
        verdict_line(found),
        title(found, len(fitted)),
        text_pairs(parameters(task, found)),
        text_table(header, rows) + "\n" + base,
    ]
    made = choices(found)
    for choice in made:
        table = text_table([choice.header, f"error{of_unit}"], choice.rows)
        parts.append(f"{choice.sentence}\n\n{table}")
    if made:
        parts[-1] += f"\n  {ERROR}"
    parts += _tried_in_short(found)
    if left_out:
        fitted_rms, left_rms = (in_unit(value, unit, 3) for value in pooled(left_out))
        parts.append(
            f"{len(left_out)} loops, each left out of the fit in turn: rms error {left_rms} "
            f"predicted, {fitted_rms} fitted"
        )
    parts.append(findings_text(found, task.records))
    return "\n\n".join(parts)


def title(found: Identification, records: int) -> str:
    """Return the kind of model and the number of samples; a partial fit is marked."""
    count = "1 record" if records == 1 else f"{records} records"
    text = f"{model_name(found)} fitted to {found.fit.samples} samples of {count}"
    glitches = sum(map(len, found.left_out_samples))
    if glitches:
        text += f", {glitches} {'glitch' if glitches == 1 else 'glitches'} left out"
    return f"PARTIAL, the search was interrupted: {text}" if found.partial else text


def model_name(found: Identification) -> str:
    """Return the kind of model and its number of operators."""
    if isinstance(found.model, ModifiedPrandtlIshlinskii):
        operators = "plays" if has_plays(found) else "coupled plays"
        return f"modified Prandtl-Ishlinskii model, {found.model.operators} {operators},"
    return f"conventional Prandtl-Ishlinskii model, {found.model.operators} plays,"


def has_plays(found: Identification) -> bool:
    """Return whether the operators are plays, which are coupled plays of these ratios."""
    return found.ratios == (1.0, 1.0, 1.0)


def parameters(task: Task, found: Identification) -> list[tuple[str, str]]:
    """Return the parameters apart from the weights, with units and standard errors."""

    def given(name: str) -> str:
        return "  (given)" if name in task.given else ""

    pairs: list[tuple[str, str]] = []
    chosen = "  (by cross-validation)"
    law = found.weights_law + (chosen if found.weights_validation else "")
    pairs.append(("weights", law))
    if found.smoothness or found.smoothness_validation:
        smoothness = f"{found.smoothness:g}" + (chosen if found.smoothness_validation else "")
        pairs.append(("smoothness", smoothness))
    if isinstance(found.model, ModifiedPrandtlIshlinskii):
        ratios = "  ".join(
            with_error(ratio, std, scale=1.0, bounds=(0.0, 1.0, 2.0))
            for ratio, std in zip(found.ratios, found.ratios_std, strict=True)
        )
        plays = "  (plays)" if has_plays(found) else ""
        pairs.append(("ratios ra/r, rb/r, rc/r", ratios + (given("ratios") or plays)))
    low, high = found.drive_range
    offset = with_error(
        *(found.model.input_offset, found.input_offset_std, task.input.unit), scale=high - low
    )
    pairs.append(("input offset", offset + given("input offset")))
    pairs += [*_maps(found), *_dynamics(task, found), *_creep(found), *_loop_shift(found, task)]
    if found.relaxing_plays is not None:
        pairs.append(("relaxing plays", relaxing_plays(found.relaxing_plays)))
    pairs += _slow_gain(found)
    if found.duhem is not None:
        pairs.append(("Duhem operator", f"{len(found.duhem.knots)} knots"))
    pairs.append(("dead time", dead_time(found) + given("dead time")))
    if found.duhem is None and found.model.not_invertible_because is not None:
        pairs.append(("not invertible", found.model.not_invertible_because))
    return pairs


def _maps(found: Identification) -> list[tuple[str, str]]:
    """Return between what the slopes of each map lie, about its mean."""

    def slopes(points: tuple[list[float], list[float]]) -> str:
        x, y = (np.asarray(values) for values in points)
        slope = np.diff(y) / np.diff(x) * np.ptp(x) / np.ptp(y)
        return f"slope {slope.min():.3f} to {slope.max():.3f} of the mean one"

    named = (("input map", found.input_map), ("output map", found.output_map))
    return [(name, slopes(points)) for name, points in named if points is not None]


def _dynamics(task: Task, found: Identification) -> list[tuple[str, str]]:
    bandwidth = found.amplifier_bandwidth
    pairs = [("amplifier bandwidth", f"{digits(bandwidth)} Hz")] if bandwidth else []
    if found.dynamics is None:
        is_needless = "dynamics" in task.given and not pairs
        return [("dynamics", "none: a dead time fits as well")] if is_needless else pairs
    if isinstance(found.dynamics, FirstOrder):
        return [("bandwidth", with_error(found.dynamics.frequency, found.frequency_std, "Hz"))]
    for number, (mode, std) in enumerate(zip(found.modes, found.modes_std, strict=True), start=1):
        several = len(found.modes) > 1
        of_mode = f", mode {number}" if several else ""
        pairs += [
            (f"natural frequency{of_mode}", with_error(mode[0], std[0], "Hz")),
            (f"damping ratio{of_mode}", with_error(mode[1], std[1])),
        ]
        if several:
            pairs.append((f"static gain{of_mode}", with_error(mode[2], std[2])))
    return pairs


def _creep(found: Identification) -> list[tuple[str, str]]:
    """Return the growth per decade of log-type creep, or else the amplitude of each term."""
    if found.creep is None:
        return []
    amplitudes, times = found.creep.amplitudes, found.creep.time_constants
    if len(found.creep_std) < len(amplitudes):
        # The terms of log-type creep share one estimate, or two.
        names = ("creep", "creep below 0.1 s")
        told = map(_percent, found.creep_amplitudes, found.creep_std)
        of_decade = [
            (name, f"{share} of a step per decade")
            for name, share in zip(names, told, strict=False)
        ]
        span = f"{digits(times[0])} to {digits(times[-1])} s, {len(times)} terms"
        return [*of_decade, ("creep time constants", span)]
    pairs = zip(amplitudes, found.creep_std, strict=True)
    shares = "  ".join(_percent(share, std) for share, std in pairs)
    return [
        ("creep", f"{shares} of a step"),
        ("creep time constants", "  ".join(f"{digits(time)} s" for time in times)),
    ]


def _percent(share: float, std: float) -> str:
    """Return an amplitude of creep with its standard error, in per cent."""
    percent = 100.0 * share
    return with_error(percent, 100.0 * std, "%", scale=max(abs(percent), _CREEP))


def _loop_shift(found: Identification, task: Task) -> list[tuple[str, str]]:
    """Return the amplitudes of the loop shift and its time constant."""
    if found.loop_shift is None:
        return []
    low, high = found.position_range
    amplitudes = zip(found.loop_shift.amplitudes, found.loop_shift_std, strict=False)
    values = "  ".join(
        with_error(value, float(std), task.output.unit, scale=high - low)
        for value, std in amplitudes
    )
    time = f"{digits(found.loop_shift.time_constant)} s"
    return [("loop shift", values), ("loop shift time constant", time)]


def _slow_gain(found: Identification) -> list[tuple[str, str]]:
    """Return the amplitude of the slow gain and its time constant."""
    if found.slow_gain is None:
        return []
    amplitude, tau = found.slow_gain.amplitude, found.slow_gain.time_constant
    of_amplitude, of_tau = found.slow_gain_std
    time = with_error(tau, of_tau, "s", scale=tau) if of_tau else f"{digits(tau)} s"
    return [("slow gain", _percent(amplitude, of_amplitude)), ("slow gain time constant", time)]


def dead_time(found: Identification) -> str:
    """Return the dead time in ms with its standard error, or in samples without a time column."""
    std = found.dead_time_std
    if found.dead_time is None:
        value = found.dead_time_samples or 0.0
        return with_error(value, std, "samples", scale=max(abs(value), 1.0))
    scale = max(abs(found.dead_time), *found.dt)
    return with_error(1e3 * found.dead_time, 1e3 * std, "ms", scale=1e3 * scale)


def value_of_dead_time(found: Identification) -> str:
    """Return the dead time with its unit alone."""
    text = dead_time(found)
    if text == NOT_DETERMINED:
        return text
    if found.dead_time is None:
        return f"{found.dead_time_samples or 0.0:.2f} samples"
    return f"{digits(1e3 * found.dead_time, 3)} ms"


def with_error(
    value: float,
    std: float,
    unit: str = "",
    *,
    scale: float | None = None,
    bounds: Collection[float] = (0.0,),
) -> str:
    """Format an estimate with its standard error, which is 0 if given and NaN at a bound.

    An error beyond the scale of the parameter, by default its value, leaves nothing to say.
    """
    if not determined(value, std, scale=scale, bounds=bounds):
        return NOT_DETERMINED
    if math.isnan(std):
        return f"{in_unit(value, unit)} (at its bound)"
    text = f"{digits(value)} ± {digits(std, 2)}" if std > 0.0 else digits(value)
    return f"{text} {unit}".rstrip()


def pooled(left_out: Sequence[LeftOutLoop]) -> tuple[float, float]:
    """Return the rms error over all loops, fitted and left out."""
    samples = sum(row.fitted.samples for row in left_out)
    pairs = [(row.fitted, row.left_out) for row in left_out]
    fitted, left = (
        math.sqrt(sum(one.mse * one.samples for one in column) / samples)
        for column in zip(*pairs, strict=True)
    )
    return fitted, left


def _rows(prefix: str, evaluated: Sequence[Evaluated], total: Quality) -> list[list[str]]:
    rows = [
        [prefix + one.record.name, *_quality(one.quality), digits(one.offset)] for one in evaluated
    ]
    if len(rows) > 1:
        rows.append([f"{prefix}all", *_quality(total), ""])
    return rows


def _quality(quality: Quality) -> list[str]:
    return [
        str(quality.samples),
        digits(quality.max_error),
        digits(quality.rmse),
        f"{quality.max_error_percent:.3f}",
        f"{quality.rmse_percent:.3f}",
        digits(quality.range),
    ]


ERROR = (
    "error: the geometric mean of the rms errors on the folds, so that no fold outweighs the others"
)
"""What stands in the tables."""


@dataclass(frozen=True)
class Choice:
    """One option that cross-validation chose."""

    header: str
    sentence: str
    """The choice and its rule."""
    candidates: list[str]
    errors: list[float]
    chosen: str

    @property
    def rows(self) -> list[list[str]]:
        """Every candidate with its typical error on the folds that were held out."""
        errors = map(digits, self.errors)
        return [[name, error] for name, error in zip(self.candidates, errors, strict=True)]

    @property
    def best(self) -> list[int]:
        """The index of the chosen row."""
        return [self.candidates.index(self.chosen)] if self.chosen in self.candidates else []


def choices(found: Identification) -> list[Choice]:
    """Return the choices in the order in which they were made."""
    simplest = "the simplest candidate whose prediction of held-out folds is as good as the best"
    laws = [str(law) for law, _ in found.weights_validation]
    counts = [str(count) for count, _ in found.cross_validation]
    smoothness = [f"{value:g}" for value, _ in found.smoothness_validation]
    law, count, value = found.weights_law, str(found.model.operators), f"{found.smoothness:g}"
    terms = [_terms(creep, shift) for creep, shift, _ in found.terms_validation]
    kept = _terms(len(found.creep_std), _shift(found))
    made = [
        _choice(
            *("terms", terms, [(None, error) for _, _, error in found.terms_validation], kept),
            *(kept, simplest),
        ),
        _choice(
            *("weights", laws, found.weights_validation, law, f"{law} weights"),
            f"{simplest}, or free weights where more operators need them",
        ),
        _choice("operators", counts, found.cross_validation, count, f"{count} operators", simplest),
        _choice(
            *("smoothness", smoothness, found.smoothness_validation, value),
            *(f"smoothness {value}", "the candidate that predicts held-out folds best"),
        ),
    ]
    return [choice for choice in made if choice.candidates]


OUTCOMES = {
    "better": "better: the search went on with it",
    "beaten": "better, but other terms are better still",
    "overruled": "taken at first; later the search went on without it",
    "not_better": "too little, or no more than chance",
    "too_small": "told, but it explains too little of what is left",
    "not_promising": "not fitted: the derivatives promise too little",
    "stands_for_other": "such a model stands for something else",
    "not_told": "not told from something else that explains as much",
    "cannot_be_told": "not tried: these records cannot tell it",
    "not_open": "not tried: needs dt, more samples, or the modified model",
    "nothing_left": "not tried: the fit leaves noise alone",
    "little_left": "not tried: the fit leaves too little for what it must gain",
    "not_fitted": "the records do not bear it",
    "needless": "left out again: it gains too little",
}
"""What came of a term that was tried."""


TRIED = ["term", "beside", "gain", "asked", "what came of it"]


def terms_tried(found: Identification) -> list[list[str]]:
    """Return a row for every term that was tried, as `TRIED` heads it."""

    def gain(judge: str, value: float | None) -> str:
        if value is None:
            return ""
        if judge == "evidence":
            return f"evidence {value:.0f}"
        if value == 1.0:
            return "no change"
        return f"error {100.0 * (1.0 / value - 1.0):+.0f} %"

    def row(one: dict[str, Any]) -> list[str]:
        judge, beside = one["judged_by"], ", ".join(one["beside"])
        gained, asked = gain(judge, one["gain"]), gain(judge, one["needed"])
        return [one["term"], beside, gained, asked, OUTCOMES[one["outcome"]]]

    return list(map(row, found.terms_tried))


# What cross-validation chose has lines of its own.
_IS_ANSWER = re.compile(r"(slow|fast) creep$|loop shift of|(weights|operators)$").search


def _tried_in_short(found: Identification) -> list[str]:
    """Return which terms were tried, and which were not; the report says what each gained."""
    untried = ("cannot_be_told", "not_open", "little_left", "nothing_left")
    searched = [one for one in found.terms_tried if not _IS_ANSWER(one["term"])]
    tried = dict.fromkeys(one["term"] for one in searched if one["outcome"] not in untried)
    untold = dict.fromkeys(
        one["term"] for one in found.terms_tried if one["outcome"] == "cannot_be_told"
    )
    lines = []
    if tried:
        lines.append(f"terms tried: {', '.join(tried)} (the report says what each gained)")
    if untold:
        lines.append(f"terms that these records cannot tell: {', '.join(untold)}")
    return ["\n".join(lines)] if lines else []


def _terms(creep: int, shift: str) -> str:
    """Return the name of a choice of terms."""
    creeps = ["no creep", "slow creep", "slow and fast creep"][min(creep, 2)]
    return f"{creeps}, " + ("no loop shift" if shift == "none" else f"loop shift {shift}")


def _shift(found: Identification) -> str:
    """Return the loop shift in the words of the candidates."""
    if found.loop_shift is None:
        return "none"
    both = "c_1 and c_2" if len(found.loop_shift_std) > 1 else "c_1"
    return f"{both}, {found.loop_shift.time_constant:g} s"


def _choice(
    header: str,
    candidates: list[str],
    pairs: Sequence[tuple[object, float]],
    chosen: str,
    name: str,
    rule: str,
) -> Choice:
    errors = [error for _, error in pairs]
    sentence = f"{name} chosen by cross-validation: {rule}"
    return Choice(header, sentence, candidates, errors, chosen)


def verdict_line(found: Identification) -> str:
    """Return the verdict in one line, with the codes of what was found, the worst first."""
    codes = list(dict.fromkeys(one.code for one in _worst_first(found.warnings)))
    interrupted = ", but the search was interrupted" if found.partial else ""
    shown = f"verdict: {found.verdict}{interrupted}"
    return shown + (f" ({', '.join(codes)})" if codes else "")


def verdict_banner(found: Identification, records: Records) -> Verdict:
    """Return the verdict at the top of the report."""
    lines = [
        f"{finding.code}: {_place(finding, records)}{finding.message}. Try: {finding.hint}."
        for finding in _worst_first(found.warnings)
    ]
    interrupted = " The search was interrupted." if found.partial else ""
    worst = found.verdict
    return Verdict(worst, f"{MEANINGS[worst]}{interrupted}", lines)


def findings_text(found: Identification, records: Records) -> str:
    """Return two lines for each warning, or one line if there is none."""
    findings = found.warnings
    if not findings:
        return "warnings: none"
    lines = [
        f"  {one.severity} {one.code}: {_place(one, records)}{one.message}{_numbers(one)}"
        f"\n    try: {one.hint}"
        for one in _worst_first(findings)
    ]
    return "\n".join(["warnings", *lines])


def _numbers(one: Finding) -> str:
    return f" (value {_number(one.value)}, limit {_number(one.limit)})"


def findings_rows(found: Identification, records: Records) -> Rows:
    """Return the findings as a table, the worst first."""
    rows = [
        [
            one.code,
            "all" if one.record is None else records.names[one.record],
            "" if one.sample is None else str(one.sample),
            one.severity,
            _number(one.value),
            _number(one.limit),
        ]
        for one in _worst_first(found.warnings)
    ]
    return ["code", "record", "sample", "severity", "value", "limit"], rows


def _number(value: float) -> str:
    return digits(value, 3) if math.isfinite(value) else NOT_DETERMINED


def _worst_first(findings: Sequence[Finding]) -> list[Finding]:
    return sorted(findings, key=lambda found: found.severity != "red")


def _place(found: Finding, records: Records) -> str:
    return "" if found.record is None else f"{records.names[found.record]}: "
