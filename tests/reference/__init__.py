"""Plain Python twin of the models: the independent oracle for the tests.

Written from the equations of doi 10.1109/JAS.2016.7510136 as corrected by the errata, one
float at a time, and it imports nothing from the package under test. Clarity before speed.
"""

from .control import Controller
from .inverses import ExactInverse, closed_form_inverse, parametric_inverse, recovered_weights
from .models import (
    ModifiedPrandtlIshlinskii,
    PrandtlIshlinskii,
    SplitModifiedPrandtlIshlinskii,
)
from .operators import CoupledPlay, OneSidedPlay, Play, printed_coupled_play
from .tables import TABLE_1, TABLE_2, paper_actuator

__all__ = [
    "TABLE_1",
    "TABLE_2",
    "Controller",
    "CoupledPlay",
    "ExactInverse",
    "ModifiedPrandtlIshlinskii",
    "OneSidedPlay",
    "Play",
    "PrandtlIshlinskii",
    "SplitModifiedPrandtlIshlinskii",
    "closed_form_inverse",
    "paper_actuator",
    "parametric_inverse",
    "printed_coupled_play",
    "recovered_weights",
]
