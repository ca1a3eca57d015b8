"""
Creep after a step
==================

Log-type creep adds nearly the same share of the step in every decade of time.
"""

import matplotlib.pyplot as plt
import mpi_hyst as mh
import numpy as np

creep = mh.plant.Creep.logarithmic(0.02, start=0.01, end=1000.0, terms=10)
dt = 0.01
position = np.asarray(creep.response([1.0] * 50_000, dt=dt))
figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
axes.semilogx(dt * np.arange(1, position.size + 1), 100.0 * (position - 1.0))
axes.set(xlabel="time after the step (s)", ylabel="creep (% of the step)")
