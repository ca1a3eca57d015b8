"""
Where is it after power-up?
===========================

Nobody knows the history, so the position is uncertain. Each motion wipes out a part of the history.
"""

import matplotlib.pyplot as plt
import mpi_hyst as mh
import numpy as np

actuator = mh.paper.table_1_recovered()
bracket = actuator.bracket(limits=(-500.0, 500.0))
drive = mh.signals.triangle(500.0, 1.0, seconds=1.2, rate=500.0)
between = np.array([bracket.step(float(u)) for u in drive])
figure, (top, bottom) = plt.subplots(2, 1, figsize=(5.0, 4.0), sharex=True, layout="constrained")
time = np.arange(drive.size) / 500.0
top.fill_between(time, between[:, 0], between[:, 1], alpha=0.5)
top.set(ylabel="position (µm)")
bottom.plot(time, 1e3 * (between[:, 1] - between[:, 0]))
bottom.set(xlabel="time (s)", ylabel="uncertain by (nm)")
