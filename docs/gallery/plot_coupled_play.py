"""
Loops of a coupled play
=======================

The coupled play has four thresholds. It rests at zero between its branches; the play does not.
"""

import matplotlib.pyplot as plt
import mpi_hyst as mh
import numpy as np

drive = np.concatenate([np.linspace(a, b, 300) for a, b in ((0, 25), (25, -25), (-25, 25))])  # V
figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
for name, (ra, rb, rc) in {
    "play: ra = rb = rc = r": (10.0, 10.0, 10.0),
    "the paper's ratios": (9.5, 3.0, 3.5),
    "rb = rc = 0": (9.5, 0.0, 0.0),
}.items():
    axes.plot(drive, mh.CoupledPlay(10.0, ra, rb, rc).run(drive), label=name)
axes.set(xlabel="drive x (V)", ylabel="output z (V)")
axes.legend(fontsize=8)
