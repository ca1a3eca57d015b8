"""Tables I and II of doi 10.1109/JAS.2016.7510136, the numbers as printed.

Table I: forward model, w in um/V, thresholds in volts. Table II: inverse model, w' in
V/um, thresholds in micrometres. The thresholds r of Table I are exact, 25 i volts; its
weights are rounded to one digit, so use ``paper_actuator`` for a model (erratum 9).
"""

from __future__ import annotations

import numpy as np

from .inverses import recovered_weights
from .models import ModifiedPrandtlIshlinskii
from .operators import Array

_TABLE_1 = """\
i,w,r,ra,rb,rc
0,0.0043,0.0000,0.0000,0.0000,0.0000
1,0.0003,25.000,23.750,7.500,8.750
2,0.0003,50.000,47.500,15.000,17.500
3,0.0002,75.000,71.250,22.500,26.250
4,0.0002,100.000,95.000,30.000,35.000
5,0.0002,125.000,118.750,37.500,43.750
6,0.0002,150.000,142.500,45.000,52.500
7,0.0001,175.000,166.250,52.500,61.250
8,0.0001,200.000,190.000,60.000,70.000
9,0.0001,225.000,213.750,67.500,78.750
10,0.0001,250.000,237.500,75.000,87.500
11,0.0001,275.000,261.250,82.500,96.250
12,0.0001,300.000,285.000,90.000,105.000
13,0.0001,325.000,308.750,97.500,113.750
14,0.0002,350.000,332.500,105.000,122.500
15,0.0002,375.000,356.250,112.500,131.250
16,0.0002,400.000,380.000,120.000,140.000
17,0.0002,425.000,403.750,127.500,148.750
18,0.0003,450.000,427.500,135.000,157.500
19,0.0003,475.000,451.250,142.500,166.250
"""

_TABLE_2 = """\
i,w_prime,r_prime,ra_prime,rb_prime,rc_prime
0,234.9005,0.0000,0.0000,0.0000,0.0000
1,-17.0350,0.1064,0.0958,0.0372,0.0372
2,-12.8939,0.2212,0.1991,0.0774,0.0774
3,-9.9779,0.3431,0.3088,0.1201,0.1201
4,-7.8667,0.4714,0.4242,0.1650,0.1650
5,-6.3131,0.6050,0.5445,0.2117,0.2117
6,-5.1645,0.7432,0.6689,0.2601,0.2601
7,-4.3238,0.8855,0.7970,0.3099,0.3099
8,-3.7267,1.0315,0.9283,0.3610,0.3610
9,-3.3295,1.1806,1.0626,0.4132,0.4132
10,-3.1008,1.3328,1.1995,0.4665,0.4665
11,-3.0166,1.4879,1.3391,0.5208,0.5208
12,-3.0567,1.6460,1.4814,0.5761,0.5761
13,-3.2021,1.8072,1.6265,0.6325,0.6325
14,-3.4337,1.9718,1.7746,0.6901,0.6901
15,-3.7312,2.1402,1.9262,0.7491,0.7491
16,-4.0730,2.3129,2.0816,0.8095,0.8095
17,-4.4364,2.4907,2.2416,0.8717,0.8717
18,-4.7987,2.6742,2.4068,0.9360,0.9360
19,-5.1381,2.8644,2.5780,1.0025,1.0025
"""


def _columns(text: str) -> dict[str, Array]:
    names, *rows = [line.split(",") for line in text.split()]
    columns = dict(zip(names, np.array(rows, dtype=float).T.copy(), strict=True))
    del columns["i"]
    for column in columns.values():
        column.flags.writeable = False
    return columns


TABLE_1 = _columns(_TABLE_1)
"""Table I by column, ``w r ra rb rc``: read-only float64 arrays, shape (20,)."""

TABLE_2 = _columns(_TABLE_2)
"""Table II by column, ``w_prime r_prime ra_prime rb_prime rc_prime``, shape (20,)."""


def paper_actuator() -> ModifiedPrandtlIshlinskii:
    """The paper's actuator, model (6): thresholds of Table I, weights recovered from Table II.

    Volts in, micrometres out, 20 operators, drive -500..500 V, virgin state.
    """
    thresholds = (TABLE_1[name] for name in ("r", "ra", "rb", "rc"))
    return ModifiedPrandtlIshlinskii(recovered_weights(TABLE_2["w_prime"]), *thresholds)
