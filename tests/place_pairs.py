"""Pairs of instants at the same place, and stages that are no model of the package."""

from __future__ import annotations

import numpy as np
from reference.models import PrandtlIshlinskii as ReferenceModel
from support import Array


def rms(values: Array) -> float:
    centred = values - values.mean()
    return float(np.sqrt(np.mean(centred**2)))


def passes(position: Array, level: float) -> Array:
    """The instants at which a position passes a level, at least five samples apart."""
    about = position - level
    before = np.flatnonzero((about[:-1] < 0) != (about[1:] < 0))
    at = before + about[before] / (about[before] - about[before + 1])
    return at[np.concatenate([[True], np.diff(at) > 5])] if at.size else at


def pairs_of(position: Array, first: int, last: int, levels: int = 300) -> Array:
    """Every later pass of a level with the first one."""
    part = position[first:last]
    spread = np.ptp(part)
    heights = np.linspace(part.min() + 0.01 * spread, part.max() - 0.01 * spread, levels)
    each = [first + passes(part, height) for height in heights]
    rows = [(0.0, at[0], later) for at in each for later in at[1:]]
    return np.array(rows)


def triangle() -> Array:
    """One period from zero to zero."""
    up, down = (
        np.linspace(0.0, 1.0, 100, endpoint=False),
        np.linspace(1.0, -1.0, 200, endpoint=False),
    )
    return np.concatenate([up, down, np.linspace(-1.0, 0.0, 100)])


def foreign(kind: str, drive: Array) -> Array:
    """Stages that are no model of the package: sums of elements, sample by sample."""
    if kind == "relays":
        up, down = (grid.ravel() for grid in np.meshgrid(*[np.linspace(-2.5, 2.5, 40)] * 2))
        kept = up > down
        up, down = up[kept], down[kept]
        weight = np.exp(-((up - 0.2) ** 2 + (down + 0.2) ** 2) / 2.0 - (up - down) / 1.2)
        state = np.where(up + down > 0.0, -1.0, 1.0)
        place = []
        for x in drive:
            state = np.where(x >= up, 1.0, np.where(x <= down, -1.0, state))
            place.append(0.8 * x + (weight * state).sum() / weight.sum())
        return np.array(place)
    if kind == "bouc_wen":
        return bouc_wen(drive, share=-0.3, rest=0.6)
    if kind == "plays":
        model = ReferenceModel([0.6, 0.1, 0.1, 0.1, 0.1], [0.0, 0.2, 0.6, 1.1, 1.7])
        return np.array([model.step(x) for x in drive])
    slips, shares = np.array([0.05, 0.15, 0.4, 0.9, 1.6]), np.array([0.08, 0.1, 0.1, 0.08, 0.08])
    stretched, last, place = np.zeros(5), drive[0], []
    for x in drive:
        stretched = np.clip(stretched + (x - last), -slips, slips)
        last = x
        place.append(x - (shares * stretched).sum())
    return np.array(place)


def bouc_wen(drive: Array, *, share: float = 0.4, rest: float = 0.9) -> Array:
    """x + share z, with z' = x' (1 - z / rest) as the drive loads and z' = x' as it unloads."""
    z, last, place = 0.0, 0.0, []
    for x in drive:
        step = (x - last) / 8
        for _ in range(8):
            z += step * (1.0 - (0.5 + 0.5 * np.sign(step * z)) * abs(z) / rest)
        last = x
        place.append(x + share * z)
    return np.array(place)
