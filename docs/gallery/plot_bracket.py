"""
Where is it after power-up?
===========================

The history is unknown, so the position lies between two bounds: the band. Each motion wipes out
a part of the history. Below: the width of the band.
"""

import matplotlib.pyplot as plt
import mpi_hyst as mh
import numpy as np

actuator = mh.paper.table_1_recovered()
bracket = actuator.bracket(limits=(-500.0, 500.0))
drive = mh.signals.triangle(500.0, 1.0, seconds=1.2, rate=500.0)
between = np.array([bracket.step(float(u)) for u in drive])
figure, axes = plt.subplots(2, 1, figsize=(5.0, 4.0), sharex=True, layout="constrained")
top, bottom = axes
time = np.arange(drive.size) / 500.0
top.fill_between(time, between[:, 0], between[:, 1], alpha=0.5)
top.plot(time, between.mean(axis=1), linewidth=0.8)
top.set(ylabel="position (µm)")
bottom.plot(time, 1e3 * (between[:, 1] - between[:, 0]))
bottom.set(xlabel="time (s)", ylabel="width (nm)")
