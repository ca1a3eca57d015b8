"""A scan put out by an NI-DAQmx device, a channel for each axis.

The scanner remembers from scan to scan. So of a scan that the device breaks off only what was put
out may count.
"""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import nidaqmx
import numpy as np
from nidaqmx.constants import AcquisitionType
from nidaqmx.stream_writers import AnalogMultiChannelWriter
from support_stage import DT, scanner


def put_out(one: mh.scan.Scanner, positions: dict[str, Any], channels: dict[str, str]) -> int:
    """Drive a scan on the channels of its axes; return the samples of every channel."""
    before, done = one.state, 0
    drives = one.run(positions, lead_in=0.1)
    samples = np.ascontiguousarray([drives[axis] for axis in channels])
    try:
        with nidaqmx.Task() as task:
            for channel in channels.values():
                task.ao_channels.add_ao_voltage_chan(channel, min_val=0.0, max_val=10.0)
            task.timing.cfg_samp_clk_timing(
                1.0 / one.dt,
                sample_mode=AcquisitionType.FINITE,
                samps_per_chan=samples.shape[1],
            )
            written = AnalogMultiChannelWriter(task.out_stream).write_many_sample(samples)
            task.start()
            try:
                task.wait_until_done(timeout=samples.shape[1] * one.dt + 5.0)
            except BaseException:
                done = task.out_stream.total_samp_per_chan_generated
                raise
    except BaseException:
        one.state = before
        one.follow({axis: drive[:done] for axis, drive in drives.items()})
        raise
    return int(written)


if __name__ == "__main__":
    raster = {
        "x": 20.0 + mh.signals.triangle(10.0, 2.0, seconds=2.0, rate=1.0 / DT),
        "y": np.linspace(20.0, 30.0, round(2.0 / DT)),
    }
    print(put_out(scanner(), raster, {"x": "Dev1/ao0", "y": "Dev1/ao1"}))
