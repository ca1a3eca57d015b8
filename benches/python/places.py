"""Where a stage is that was identified without a position sensor.

`make bench-places`. The stages and the pairs are those of `tests/test_places.py` and
`tests/test_images.py`.

First the measured stack: pairs are cut from the sensor record of its full loops, from several
stretches of it, exact and with an error of the match of a pixel of 512. A figure is the rms error
on the decaying loops, which were not used, as a share of the range of the full ones.

Then two simulated scans of an unknown sample, with noise, drift of the lines and wrong matches. A
figure is the error in a third scan of another size and offset, as a share of its range: rms and
largest along the trace, about the mean; beside it how far trace and retrace are apart before. The
time is that of the matches of two scans and of the identification.
"""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import test_images
from place_pairs import pairs_of, rms
from records import Array, heading, tell, timed
from test_places import DT, measured, missed, moved_by_a_pixel, of_full_loops

STRETCHES = (
    (400, 1200),
    (400, 1100),
    (400, 1300),
    (420, 1250),
    (450, 1200),
    (600, 1400),
    (800, 1600),
)
WRONG = 0.05  # share of the matches


def third_scan(pixels: int, seed: int) -> str:
    """What is said of a third scan of so many pixels."""
    middle = test_images.MIDDLE
    scans = [
        test_images.scan(size, middle + offset, pixels, seed + number)
        for number, (size, offset) in enumerate(((1.8, 0.0), (1.0, -0.2)))
    ]
    drives = [one.drive for one in scans]
    known = [test_images.known_length(scans[0])]

    def matches() -> Array:
        return np.vstack([test_images.pairs_of(one, k) for k, one in enumerate(scans)])

    matching, pairs = timed(matches)
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(pairs)) < WRONG
    pairs[wrong, 2] += rng.uniform(-0.4, 0.4, wrong.sum()) * pixels
    fitting, found = timed(lambda: mh.identify_places(drives, pairs, known, dt=DT))
    third = test_images.scan(1.4, middle + 0.25, pixels, seed + 2)
    line = slice(-2 * pixels, -pixels)
    true, said = third.position[line], found.predict(third.drive)[line]
    off = (said - said.mean()) - (true - true.mean())
    apart = third.position[-pixels:][::-1] - true
    shares = [100.0 * share / np.ptp(true) for share in (rms(off), np.abs(off).max())]
    before = [100.0 * share / np.ptp(true) for share in (rms(apart), np.abs(apart).max())]
    errors = "  ".join(f"{share:8.2f}" for share in (*shares, *before))
    return f"{pixels:>6}  {seed:>4}  {errors}  {len(pairs):>7}  {matching} + {fitting}"


def main() -> None:
    tell(heading())
    tell("measured stack: error on decaying loops, % of the range")
    tell("samples of full loops  exact  one pixel of 512")
    stack = measured()
    y = stack[1]
    for first, last in STRETCHES:
        exact = pairs_of(y, first, last)
        noisy = [moved_by_a_pixel(y, exact, first, last, seed) for seed in range(3)]
        found = [of_full_loops(stack, pairs, last) for pairs in (exact, *noisy)]
        of_exact, *errors = (100.0 * missed(stack, one) for one in found)
        of_noisy = " ".join(f"{error:.2f}" for error in errors)
        tell(f"{first:>6} to {last:<6}       {of_exact:8.3f}  {of_noisy}")
    tell("simulated scans, % of the range of the third")
    tell("pixels  seed  off, rms   largest    before   largest    pairs  matching + fitting")
    for pixels, seeds in ((128, range(1, 6)), (512, range(1, 3))):
        for seed in seeds:
            tell(third_scan(pixels, seed))


if __name__ == "__main__":
    main()
