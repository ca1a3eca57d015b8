"""
Scans
=====

Two rasters of the same image, 10 µm wide. Both begin and end at rest, with continuous position,
velocity and acceleration.
"""

import matplotlib.pyplot as plt
import mpi_hyst as mh

scans = {
    "Raster": mh.trajectories.Raster(10.0, 10.0, 12, line_rate=5.0),
    "Raster, bidirectional": mh.trajectories.Raster(
        10.0, 10.0, 12, line_rate=5.0, bidirectional=True
    ),
}
figure, panels = plt.subplots(1, 2, figsize=(6.4, 3.2), layout="constrained", sharey=True)
for axes, (name, scan) in zip(panels, scans.items(), strict=True):
    axes.plot(scan.x.sample(dt=1e-3)[0], scan.y.sample(dt=1e-3)[0], linewidth=0.7)
    axes.set(title=name, xlabel="x (µm)", aspect="equal")
panels[0].set_ylabel("y (µm)")
