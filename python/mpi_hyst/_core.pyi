# The compiled core. Docstrings are in the module itself: help(mpi_hyst). The methods `plot`, `report` and `_repr_html_` are set by
# `_methods.py`.
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from os import PathLike
from pathlib import Path
from typing import (
    Any,
    Literal,
    Protocol,
    SupportsFloat,
    SupportsIndex,
    TypeAlias,
    final,
    overload,
    type_check_only,
)

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

_Vector = NDArray[np.float64]
_Matrix = NDArray[np.float64]
_Complex = NDArray[np.complex128]
_Units: TypeAlias = tuple[str, str] | None
_LearningPhase: TypeAlias = Literal["learning", "fading", "stopped"]
_Structure: TypeAlias = Literal["proportional-integral", "low-pass", "active damping", "notch"]

__all__ = [
    "ActuatorArray",
    "Antiresonance",
    "ArrayController",
    "Biquad",
    "Bracket",
    "BracketArray",
    "ComparedModel",
    "Comparison",
    "ControllerTerms",
    "CoupledPlay",
    "Creep",
    "DynamicsIdentification",
    "Excitation",
    "ExperimentPart",
    "ExperimentSegment",
    "Filter",
    "Finding",
    "FirstOrder",
    "Forward",
    "ForwardArray",
    "Functions",
    "HybridController",
    "Identification",
    "Inverse",
    "InverseArray",
    "IterativeLearning",
    "Lead",
    "LeftOutLoop",
    "Lissajous",
    "LoopReport",
    "LoopShift",
    "LoopTimes",
    "LowPass",
    "ManyIdentifications",
    "Margins",
    "Metrics",
    "Modes",
    "ModifiedPrandtlIshlinskii",
    "MultiAxisController",
    "MultiAxisPlant",
    "NotInvertibleError",
    "Notch",
    "Observer",
    "Plant",
    "Play",
    "PointToPoint",
    "PrandtlIshlinskii",
    "Preview",
    "Quality",
    "Raster",
    "RecursiveIdentifier",
    "RepetitiveControl",
    "RoundedTriangle",
    "Run",
    "ScanAxis",
    "SecondOrder",
    "SharedMemory",
    "Sine",
    "Spiral",
    "Stage",
    "StageForward",
    "StageInverse",
    "StateSpace",
    "Stop",
    "Tuning",
    "Udp",
    "__version__",
    "c_header_text",
    "c_name",
    "chirp",
    "compare",
    "decaying_triangle",
    "demagnetize",
    "diagnose",
    "excitation",
    "experiment",
    "fmu_texts",
    "gains",
    "identify",
    "identify_dynamics",
    "identify_many",
    "invert_dynamics",
    "load",
    "load_from",
    "loop_width",
    "multisine",
    "plant",
    "precompensate",
    "preview",
    "read_bytes",
    "run",
    "simulate",
    "sine",
    "table_1",
    "table_1_recovered",
    "table_2",
    "triangle",
    "tune",
    "verdict",
]

__version__: str

class NotInvertibleError(ValueError):
    """The model's slope may vanish or turn negative, so one output may belong to several inputs.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> falling = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])  # the slope turns negative
    >>> try:
    ...     falling.inverse()
    ... except mh.NotInvertibleError as error:
    ...     print("refused")
    refused
    """

@final
class Play:
    """The play operator, equations (1)-(3): z(k) = max(x - r, min(x + r, z(k-1))).

    Parameters
    ----------
    r : float
        Threshold, at least 0, in the unit of the input.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> play = mh.Play(10.0)
    >>> play.step(25.0), play.step(20.0), play.step(0.0)
    (15.0, 15.0, 10.0)
    """

    def __new__(cls, r: float) -> Play: ...
    @property
    def r(self) -> float:
        """The threshold."""
    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    def follow(self, inputs: ArrayLike) -> None:
        """Takes over the inputs before, oldest first."""
    @property
    def state(self) -> float:
        """The last output z: the whole memory. Set it to continue from there."""
    @state.setter
    def state(self, state: float) -> None: ...
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""

@final
class CoupledPlay:
    """The coupled-play (CP) operator, equation (5): z(k) = max(lo, min(hi, z(k-1))).

    lo(x) = max(x - r, min(0, x - rc)) and hi(x) = min(x + ra, max(0, x + rb)). Rising, z follows x - rc below zero,
    sticks at zero from x = rc to x = r, then follows x - r. Falling, it follows x + rb above zero, sticks at zero from
    x = -rb to x = -ra, then follows x + ra.

    Parameters
    ----------
    r, ra, rb, rc : float
        Thresholds in the unit of the input, r >= rc >= 0 (rising) and ra >= rb >= 0 (falling).

    Examples
    --------
    The walk of Fig. 5 of the paper:

    >>> import mpi_hyst as mh
    >>> mh.CoupledPlay(10, 8, 3, 4).run([0, 20, -20, 15, 6, 25, -15, -5])
    array([  0.,  10., -12.,   5.,   5.,  15.,  -7.,  -7.])
    """

    def __new__(cls, r: float, ra: float, rb: float, rc: float) -> CoupledPlay: ...
    @property
    def r(self) -> float:
        """Rising above zero: z = x - r."""
    @property
    def ra(self) -> float:
        """Falling below zero: z = x + ra."""
    @property
    def rb(self) -> float:
        """Falling above zero: z = x + rb."""
    @property
    def rc(self) -> float:
        """Rising below zero: z = x - rc."""
    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    def follow(self, inputs: ArrayLike) -> None:
        """Takes over the inputs before, oldest first."""
    @property
    def state(self) -> float:
        """The last output z: the whole memory. Set it to continue from there."""
    @state.setter
    def state(self, state: float) -> None: ...
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""

@final
class Forward:
    """The output of a model, sample by sample: made by `model.forward()`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> forward = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]).forward()
    >>> forward.step(4.0), forward.step(3.0)
    (5.0, 4.0)
    >>> forward.memory  # the reversal at 4 still matters
    array([4.])
    >>> saved = forward.state
    >>> forward.step(-9.0)
    -12.5
    >>> forward.state = saved
    >>> forward.step(-9.0)
    -12.5
    """

    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def follow(self, inputs: ArrayLike) -> None:
        """Takes over what was put in before, oldest input first."""
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    def set_model(self, model: PrandtlIshlinskii | ModifiedPrandtlIshlinskii) -> None:
        """Goes on with the weights and the output offset of another model of the same thresholds and input offset: input and
        memory stay, the output is that of the new model.

        Raises ValueError that names what differs; the stream is as before then.
        """
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for
        bit.

        A stream of the other `method` takes it too, and goes on with the same outputs to 1e-12 of the range. Turning
        points cannot tell operator outputs that no drive leads to, as `initial` may be: then ValueError is raised, and
        the stream is as before.
        """
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    @property
    def memory(self) -> _Vector:
        """The reversals of the model's input that still determine its output, oldest first; empty for a bank."""
    @property
    def method(self) -> Literal["turning_points", "bank"]:
        """ "turning_points" (nested thresholds, from rest) or "bank" (anything else, or if asked for)."""
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""
    def plot(self, *, units: _Units = None, axes: Sequence[Axes] | None = None) -> Figure:
        """Draw it with `mpi_hyst.plot.memory`, which has the arguments."""

@final
class Inverse:
    """The exact inverse of a model, sample by sample: made by `model.inverse(limits)`.

    A target out of reach puts the drive at the limit and sets `saturated`; the drive leaves the limit without a jump
    when the target comes back.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> actuator = mh.paper.table_1_recovered()
    >>> inverse = actuator.inverse(limits=(-500.0, 500.0))
    >>> drive = inverse.run([0.0, 1.0, 2.0, 1.5])
    >>> bool(abs(actuator.forward().run(drive) - [0.0, 1.0, 2.0, 1.5]).max() < 1e-14)
    True
    >>> inverse.step(99.0), inverse.saturated
    (500.0, True)
    """

    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first."""
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    def set_model(self, model: PrandtlIshlinskii | ModifiedPrandtlIshlinskii) -> None:
        """Goes on with the weights and the output offset of another model of the same thresholds and input offset, without a
        jump of the drive: the drive and the memory stay, the next target is met by the new model.

        The output of the new model at the present drive, as a target, gives the present drive.

        Raises ValueError that names what differs, NotInvertibleError if the new model may not be invertible; the stream
        is as before then.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> inverse = mh.PrandtlIshlinskii([1.0, 1.0], [0.0, 2.0]).inverse()
        >>> inverse.step(6.0)
        4.0
        >>> inverse.set_model(mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]))
        >>> inverse.step(5.0), inverse.step(4.0)  # 5.0 is the new output at the drive 4.0
        (4.0, 3.0)
        """
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for
        bit.

        A stream of the other `method` takes it too, and goes on with the same outputs to 1e-12 of the range. Turning
        points cannot tell operator outputs that no drive leads to, as `initial` may be: then ValueError is raised, and
        the stream is as before.
        """
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    @property
    def memory(self) -> _Vector:
        """The reversals of the model's input that still determine its output, oldest first; empty for a bank."""
    @property
    def saturated(self) -> bool:
        """Whether the last target was out of reach and the drive is at a limit."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits of the drive (low, high), or None."""
    @property
    def method(self) -> Literal["turning_points", "bank"]:
        """ "turning_points" (nested thresholds, from rest) or "bank" (anything else, or if asked for)."""
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""
    def plot(self, *, units: _Units = None, axes: Sequence[Axes] | None = None) -> Figure:
        """Draw it with `mpi_hyst.plot.memory`, which has the arguments."""

@final
class PrandtlIshlinskii:
    """The conventional Prandtl-Ishlinskii model (CPI), equation (4): y = output_offset + sum_i w_i z_i.

    z_i is the play of threshold r_i at the input x - input_offset.

    Parameters
    ----------
    weights : array of n floats
        w_i, in output unit per input unit.
    thresholds : array of n floats
        r_i >= 0, in the unit of the input.
    input_offset, output_offset : float
        Where the model's own zero lies.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> model = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])
    >>> model.forward().run([4.0, 3.0, -4.0])
    array([ 5.,  4., -5.])
    """

    def __new__(
        cls,
        weights: ArrayLike,
        thresholds: ArrayLike,
        *,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
    ) -> PrandtlIshlinskii: ...
    @property
    def weights(self) -> _Vector:
        """The weights w_i, read-only."""
    @property
    def thresholds(self) -> _Vector:
        """The thresholds r_i, read-only."""
    @property
    def operators(self) -> int:
        """The number of operators n."""
    @property
    def input_offset(self) -> float:
        """Subtracted from the input."""
    @property
    def output_offset(self) -> float:
        """Added to the output."""
    @property
    def slope_range(self) -> tuple[float, float]:
        """The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) if no weight is negative.

        Of a split operator the smaller weight counts for the least, the greater for the greatest.
        """
    @property
    def invertible(self) -> bool:
        """Whether the weight of the identity operators (all thresholds zero) outweighs all negative weights together."""
    @property
    def not_invertible_because(self) -> str | None:
        """Why the model is not invertible, or None."""
    def forward(
        self,
        initial: ArrayLike | None = None,
        *,
        method: Literal["turning_points", "bank"] | None = None,
    ) -> Forward:
        """The forward model as a stream, at rest or from the operator outputs `initial`.

        `method` None takes "turning_points" where it can: what a sample costs hardly hangs on the number of operators. "bank"
        computes all operators for a sample that leaves the line: with AVX2 it is several times faster for some tens of
        operators where every sample is a jump, and slower on a smooth drive. Both give the same outputs, to
        1e-12 of the range, and either goes on from a `state` of the other.

        Raises ValueError for thresholds that are not nested if "turning_points" is asked for.
        """
    def inverse(
        self,
        limits: Sequence[float] | None = None,
        initial: ArrayLike | None = None,
        *,
        method: Literal["turning_points", "bank"] | None = None,
    ) -> Inverse:
        """The exact inverse as a stream, the drive within `limits` (low, high).

        `method` as in `forward`; an inverse gains nothing by "bank".

        Raises NotInvertibleError if the model may not be invertible.
        """
    def closed_form_inverse(self) -> PrandtlIshlinskii:
        """The inverse as another conventional model, in closed form.

        w'_0 = 1 / w_0, w'_i = -w_i / (S_i S_(i-1)), r'_i = sum_(j<=i) w_j (r_i - r_j), S_i = sum_(j<=i) w_j.

        Raises ValueError unless r_0 = 0, thresholds never decrease and every S_i > 0.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> model = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])
        >>> model.closed_form_inverse().thresholds
        array([0., 2.])
        """
    def bracket(self, limits: Sequence[float]) -> Bracket:
        """How uncertain the output is when the history between the limits (low, high) is unknown.

        Raises ValueError for a model with a negative weight.
        """
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the model to a JSON file; the file appears only when it is complete."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def plot(
        self,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
        *,
        record: int | None = None,
        skip: int = 0,
        dt: float | None = None,
        units: _Units = None,
        axes: Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw it with `mpi_hyst.plot.loops`, which has the arguments."""
    def _repr_html_(self) -> str: ...

@final
class ModifiedPrandtlIshlinskii:
    """The modified Prandtl-Ishlinskii model (MPI), equation (6): y = output_offset + sum_i w_i z_i.

    z_i is the coupled play of thresholds r_i, ra_i, rb_i, rc_i at the input x - input_offset.

    Parameters
    ----------
    weights : array of n floats
        w_i, in output unit per input unit (um/V).
    r, ra, rb, rc : arrays of n floats
        Thresholds in the unit of the input (V), r_i >= rc_i >= 0 and ra_i >= rb_i >= 0.
    input_offset, output_offset : float
        Where the model's own zero lies.
    weights_negative : array of n floats, optional
        v_i: makes a split model, where z_i counts with w_i above zero and with v_i below. By default, or equal to
        w_i, there is no split.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> model = mh.ModifiedPrandtlIshlinskii.from_ratios(
    ...     [4.0e-3, 3.0e-4], [0.0, 25.0], ra=0.95, rb=0.30, rc=0.35)
    >>> round(model.forward().step(100.0), 6)
    0.4225
    """

    def __new__(
        cls,
        weights: ArrayLike,
        r: ArrayLike,
        ra: ArrayLike,
        rb: ArrayLike,
        rc: ArrayLike,
        *,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
        weights_negative: ArrayLike | None = None,
    ) -> ModifiedPrandtlIshlinskii: ...
    @staticmethod
    def from_ratios(
        weights: ArrayLike,
        r: ArrayLike,
        *,
        ra: float,
        rb: float,
        rc: float,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
        weights_negative: ArrayLike | None = None,
    ) -> ModifiedPrandtlIshlinskii:
        """A model whose operators share the proportions of their thresholds: ra_i = ra r_i, rb_i = rb r_i, rc_i = rc r_i.

        The paper's actuator has ra = 0.95, rb = 0.30, rc = 0.35 (Table I).

        Parameters
        ----------
        weights, r : arrays of n floats
        ra, rb, rc : float
            Ratios, ra >= rb >= 0 and 1 >= rc >= 0.
        input_offset, output_offset : float
        weights_negative : array of n floats, optional
        """
    @property
    def weights(self) -> _Vector:
        """The weights w_i, read-only; in a split model those above zero."""
    @property
    def weights_negative(self) -> _Vector:
        """The weights v_i below zero, read-only: equal to `weights` unless the model is split."""
    @property
    def split(self) -> bool:
        """Whether operators have other weights below zero than above."""
    @property
    def r(self) -> _Vector:
        """The thresholds r_i (rising above zero: z = x - r), read-only."""
    @property
    def ra(self) -> _Vector:
        """The thresholds ra_i (falling below zero: z = x + ra), read-only."""
    @property
    def rb(self) -> _Vector:
        """The thresholds rb_i (falling above zero: z = x + rb), read-only."""
    @property
    def rc(self) -> _Vector:
        """The thresholds rc_i (rising below zero: z = x - rc), read-only."""
    @property
    def operators(self) -> int:
        """The number of operators n."""
    @property
    def input_offset(self) -> float:
        """Subtracted from the input."""
    @property
    def output_offset(self) -> float:
        """Added to the output."""
    @property
    def slope_range(self) -> tuple[float, float]:
        """The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) if no weight is negative.

        Of a split operator the smaller weight counts for the least, the greater for the greatest.
        """
    @property
    def invertible(self) -> bool:
        """Whether the weight of the identity operators (all thresholds zero) outweighs all negative weights together."""
    @property
    def not_invertible_because(self) -> str | None:
        """Why the model is not invertible, or None."""
    def forward(
        self,
        initial: ArrayLike | None = None,
        *,
        method: Literal["turning_points", "bank"] | None = None,
    ) -> Forward:
        """The forward model as a stream, at rest or from the operator outputs `initial`.

        `method` None takes "turning_points" where it can: what a sample costs hardly hangs on the number of operators. "bank"
        computes all operators for a sample that leaves the line: with AVX2 it is several times faster for some tens of
        operators where every sample is a jump, and slower on a smooth drive. Both give the same outputs, to
        1e-12 of the range, and either goes on from a `state` of the other.

        Raises ValueError for thresholds that are not nested if "turning_points" is asked for.
        """
    def inverse(
        self,
        limits: Sequence[float] | None = None,
        initial: ArrayLike | None = None,
        *,
        method: Literal["turning_points", "bank"] | None = None,
    ) -> Inverse:
        """The exact inverse as a stream, the drive within `limits` (low, high).

        `method` as in `forward`; an inverse gains nothing by "bank".

        Raises NotInvertibleError if the model may not be invertible.
        """
    def parametric_inverse(
        self, ra: float = 0.9, rb: float = 0.35, rc: float = 0.35
    ) -> ModifiedPrandtlIshlinskii:
        """The parametric inverse of the paper, equation (7) and Table II: another modified model, input um, output V.

        Weights and r' as in the closed form of the conventional model, then ra' = ra r', rb' = rb r', rc' = rc r'.
        Only approximately an inverse: it leaves 0.73 % of peak-to-peak on the paper's actuator. `inverse()` is exact.

        Raises ValueError unless r_0 = 0, r never decreases and every partial sum of the weights is positive.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> table_2 = mh.paper.table_1_recovered().parametric_inverse()
        >>> bool(abs(table_2.weights - mh.paper.table_2().weights).max() < 5.1e-5)
        True
        """
    def bracket(self, limits: Sequence[float]) -> Bracket:
        """How uncertain the output is when the history between the limits (low, high) is unknown.

        Raises ValueError for a model with a negative weight.
        """
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the model to a JSON file; the file appears only when it is complete."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def plot(
        self,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
        *,
        record: int | None = None,
        skip: int = 0,
        dt: float | None = None,
        units: _Units = None,
        axes: Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw it with `mpi_hyst.plot.loops`, which has the arguments."""
    def _repr_html_(self) -> str: ...

_Model = PrandtlIshlinskii | ModifiedPrandtlIshlinskii

@final
class ActuatorArray:
    """Many actuators side by side, as in a deformable mirror: actuator m has the model models[m] and its own memory.

    Equal models are kept once, so `[model] * 4096` costs little more than one.

    Parameters
    ----------
    models : sequence of M models
        PrandtlIshlinskii or ModifiedPrandtlIshlinskii, mixed as you like.

    Raises
    ------
    ValueError, TypeError
        Without a model, or that name the one that is none.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> mirror = mh.ActuatorArray([mh.paper.table_1_recovered()] * 4096)
    >>> mirror
    <ActuatorArray of 4096 actuators, 1 model>
    >>> inverse, plant = mirror.inverse(limits=(-500.0, 500.0)), mirror.forward()
    >>> target = np.linspace(-3.0, 3.0, len(mirror))  # um
    >>> drive = np.empty(len(mirror))  # V
    >>> _ = inverse.step(target, out=drive)  # writes into drive, allocates nothing
    >>> bool(abs(plant.step(drive) - target).max() < 1e-13)
    True
    """

    def __new__(cls, models: Iterable[_Model]) -> ActuatorArray: ...
    @property
    def models(self) -> tuple[_Model, ...]:
        """The model of every actuator."""
    def forward(self, *, method: Literal["turning_points", "bank"] | None = None) -> ForwardArray:
        """The forward models as one stream of arrays, at rest.

        `method` for all actuators, as for a single model: "bank" where every command jumps by about a tenth of the range or more
        and operators are few. None chooses for each one.

        Raises ValueError that names the first actuator whose thresholds are not nested if "turning_points" is asked for.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
        >>> forward = mirror.forward(method="bank")
        >>> forward.step([4.0, -4.0, 1.0])
        array([ 5., -5.,  1.])
        >>> forward.method
        ['bank', 'bank', 'bank']
        """
    def inverse(
        self,
        limits: ArrayLike | None = None,
        *,
        method: Literal["turning_points", "bank"] | None = None,
    ) -> InverseArray:
        """The exact inverses as one stream of arrays, at rest.

        `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator.

        `method` as in `forward`. Inverses gain by "bank" only where thousands of actuators, each with a model of its own, jump over
        the whole range.

        Raises NotInvertibleError that names the first actuator whose model may not be invertible.
        """
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the models to a JSON file, each model once; the file appears only when it is complete."""
    @staticmethod
    def load(path: str | PathLike[str]) -> ActuatorArray:
        """Reads what `save` wrote.

        Raises OSError if the file cannot be read, ValueError if it is no such file.
        """
    def set_model(self, actuator: int, model: _Model) -> ActuatorArray:
        """An array like this one, with another model for one actuator. The array itself never changes.

        `actuator` counts from the end if it is negative.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> soft, stiff = (mh.PrandtlIshlinskii([w, 0.5], [0.0, 2.0]) for w in (2.0, 1.0))
        >>> mirror = mh.ActuatorArray([soft] * 3)
        >>> repaired = mirror.set_model(-1, stiff)
        >>> repaired.models == (soft, soft, stiff), mirror.models == (soft,) * 3
        (True, True)
        """
    def bracket(self, limits: ArrayLike) -> BracketArray:
        """How uncertain the outputs are when the history of the drives, between `limits`, is unknown.

        `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator.

        Raises ValueError that names the first actuator whose model has a negative weight.
        """
    def demagnetize(
        self,
        limits: ArrayLike,
        *,
        slew: ArrayLike,
        rate: float = 10000.0,
        cycles: int = 20,
        shape: Literal["triangle", "sine"] = "triangle",
        center: ArrayLike | None = None,
        start: ArrayLike | None = None,
    ) -> tuple[_Matrix, _Vector]:
        """One decaying alternation for all actuators, and what it leaves of their memory.

        Every drive goes from its start to its center, alternates about the center with a common share of its own amplitude, and
        goes back. All turn at the same samples; the slowest actuator sets the pace. `mh.signals.demagnetize` says what the
        sequence leaves of the memory of one actuator.

        Parameters
        ----------
        limits : (low, high) or array of shape (M, 2)
            Of the drives (V): never left. What was driven before lies between them.
        slew : float or array of shape (M,)
            Largest speed of the drives (V/s).
        rate : float
            Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
        cycles : int
            Cycles that the alternation takes to decay.
        shape : "triangle" or "sine"
            Straight moves from reversal to reversal, or half cosines of the same largest speed.
        center : float or array of shape (M,), optional
            What the alternation decays to: the middle of the limits unless given.
        start : float or array of shape (M,), optional
            Where the drives start and end: zero, or the limit nearest to it, unless given.

        Returns
        -------
        drives : array of shape (samples, M)
        left : array of shape (M,)
            How far, at most, the output at the end is from that of the model at rest, which goes straight to its start: whatever was
            driven before between the limits, in the unit of the models' output. It is small if `center` is the input offset of the
            model, in the middle of its limits. NaN for a model with a negative weight: nothing is guaranteed then. (How far the
            outputs of two histories can be apart is the width of `array.bracket(limits)` behind its `follow(drives)`.)

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> model = mh.paper.table_1_recovered()
        >>> mirror = mh.ActuatorArray([model] * 3)
        >>> limits = [(-500.0, 500.0), (-300.0, 300.0), (-150.0, 150.0)]
        >>> drives, left = mirror.demagnetize(limits, slew=2000.0, rate=1000.0)
        >>> bool((left < 0.02 * mirror.bracket(limits).width).all())
        True
        """
    def controller(
        self,
        dt: float,
        limits: ArrayLike,
        *,
        ki: float = 0.0,
        reconstruction: ArrayLike | None = None,
        leak: float = 0.0,
        slew: ArrayLike | None = None,
        neighbours: ArrayLike | None = None,
        max_difference: ArrayLike | None = None,
        bumpless_time: float = 0.005,
        start_drive: ArrayLike | None = None,
    ) -> ArrayController:
        """A controller of all actuators, with the exact inverses at rest.

        Parameters
        ----------
        dt : float
            The sampling interval in seconds.
        limits : (low, high) or array of shape (M, 2)
            Of the drives, in volts.
        ki : float
            The integral gain per second. With direct sensors and one sample of delay the loop is stable below ki dt = 1, and calm
            at 0.3.
        reconstruction : array of shape (M, S), optional
            What makes errors of the actuators of those of S sensors, such as the pseudo-inverse of the measured response matrix.
            Without it sensor i measures actuator i.
        leak : float
            How fast the integral goes to zero by itself, per second: at most 1 / dt.
        slew : float or array of shape (M,), optional
            How fast the drives may move, in V/s.
        neighbours : array of shape (P, 2), optional
            Pairs of actuators, by their numbers, whose positions must not be too far apart.
        max_difference : float or array of shape (P,), optional
            How far the modelled positions of each pair may be apart. Given with `neighbours`.
        bumpless_time : float
            How long, in seconds, the difference at a start takes to go to zero. From a start on the integral rests for that time.
        start_drive : float or array of shape (M,), optional
            The drives that the amplifiers have at the start: by default zero or the limit nearest to it.

        Returns
        -------
        ArrayController

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came.
        NotInvertibleError
            That names the first actuator whose model may not be invertible.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
        >>> controller = mirror.controller(
        ...     1e-3, (-10.0, 10.0), slew=2e4, neighbours=[(0, 1), (1, 2)], max_difference=2.0, bumpless_time=0.0
        ... )
        >>> _ = controller.step([0.0, 0.0, 0.0])  # a motion starts from the drives that are there
        >>> _ = controller.step([3.0, 3.0, 9.0])  # the last step is too high
        >>> controller.position.round(6)
        array([3., 5., 7.])
        """
    @overload
    def __getitem__(self, actuator: SupportsIndex, /) -> _Model: ...
    @overload
    def __getitem__(self, actuator: slice, /) -> ActuatorArray: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class ForwardArray:
    """The outputs of many models, sample by sample: made by `array.forward()`.

    Bit for bit what M streams of the single models give. A sample that is not finite holds its own actuator only.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> soft, stiff = (mh.PrandtlIshlinskii([w, 0.5], [0.0, 2.0]) for w in (2.0, 1.0))
    >>> forward = mh.ActuatorArray([soft, stiff]).forward()
    >>> forward.step([4.0, 4.0])
    array([9., 5.])
    >>> forward.run([[3.0, 3.0], [-4.0, float("nan")]], threads=2)
    array([[ 7.,  4.],
           [-9.,  4.]])
    >>> forward.rejected
    array([0, 1], dtype=uint64)
    """

    def step(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes one sample for each actuator, an array of shape (M,), and gives the outputs in `out` or a new array.

        A C-contiguous float64 array is read in place; with `out` no array is allocated then.
        """
    def peek(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """What `step` would give, without taking the samples."""
    def run(self, input: ArrayLike, out: _Matrix | None = None, threads: int = 1) -> _Matrix:
        """Takes rows of samples, an array of shape (samples, M), bit for bit like `step` in a loop, into `out` or a
        new array.

        With `threads` > 1 that many threads share out the actuators: the same bits, sooner, where many samples
        are known beforehand.
        """
    def set_model(self, actuator: int, model: _Model) -> None:
        """One actuator goes on with the weights and the output offset of another model of the same thresholds and
        input offset, as a stream of it would.

        Raises ValueError that names what differs; the stream is as before then.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over rows of drives that were put out before, oldest row first."""
    def reset(self) -> None:
        """Every actuator back to rest."""
    @property
    def state(self) -> list[dict[str, Any]]:
        """Everything that the streams remember, as a list of M dictionaries to keep; set it to continue from there
        bit for bit. Each is the `state` of a single stream of its model, of either `method`.
        """
    @state.setter
    def state(self, state: list[dict[str, Any]]) -> None: ...
    @property
    def method(self) -> list[Literal["turning_points", "bank"]]:
        """How each actuator is evaluated, "turning_points" or "bank": a list of M words."""
    @property
    def rejected(self) -> NDArray[np.uint64]:
        """How many samples of each actuator were not finite, or beyond 1e100."""
    def __len__(self) -> int: ...

@final
class InverseArray:
    """The exact inverses of many models, sample by sample: made by `array.inverse(limits)`.

    Bit for bit what M streams of the single models give. A target out of reach puts the drive of its actuator at the
    limit and sets its `saturated`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
    >>> inverse = mirror.inverse(limits=[(-10.0, 10.0), (-10.0, 10.0), (0.0, 4.0)])
    >>> inverse.step([5.0, -5.0, 99.0])
    array([ 4., -4.,  4.])
    >>> inverse.saturated
    array([False, False,  True])
    >>> saved = inverse.state
    >>> inverse.step([3.0, -3.0, 3.0])
    array([ 2., -2.,  2.])
    >>> inverse.state = saved
    >>> inverse.step([3.0, -3.0, 3.0])
    array([ 2., -2.,  2.])
    """

    def step(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes one sample for each actuator, an array of shape (M,), and gives the outputs in `out` or a new array.

        A C-contiguous float64 array is read in place; with `out` no array is allocated then.
        """
    def peek(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """What `step` would give, without taking the samples."""
    def run(self, input: ArrayLike, out: _Matrix | None = None, threads: int = 1) -> _Matrix:
        """Takes rows of samples, an array of shape (samples, M), bit for bit like `step` in a loop, into `out` or a
        new array.

        With `threads` > 1 that many threads share out the actuators: the same bits, sooner, where many samples
        are known beforehand.
        """
    def set_model(self, actuator: int, model: _Model) -> None:
        """One actuator goes on with the weights and the output offset of another model of the same thresholds and
        input offset, as a stream of it would.

        Raises ValueError that names what differs; the stream is as before then.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over rows of drives that were put out before, oldest row first."""
    def reset(self) -> None:
        """Every actuator back to rest."""
    @property
    def state(self) -> list[dict[str, Any]]:
        """Everything that the streams remember, as a list of M dictionaries to keep; set it to continue from there
        bit for bit. Each is the `state` of a single stream of its model, of either `method`.
        """
    @state.setter
    def state(self, state: list[dict[str, Any]]) -> None: ...
    @property
    def method(self) -> list[Literal["turning_points", "bank"]]:
        """How each actuator is evaluated, "turning_points" or "bank": a list of M words."""
    @property
    def rejected(self) -> NDArray[np.uint64]:
        """How many samples of each actuator were not finite, or beyond 1e100."""
    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Whether the last target of each actuator was out of reach and its drive is at a limit."""
    @property
    def limits(self) -> _Matrix | None:
        """The limits of the drives as an array of shape (M, 2), or None."""
    def __len__(self) -> int: ...

@final
class Quality:
    """The errors of a fit, each with its unit or base.

    `max_error` and `rmse` are in the unit of the output, `mse` in its square. Percentages are of `range`, the peak-to-peak
    of the measured output over the fitted samples, or where they say so of `amplitude`, half of it.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> quality = mh.identify(u, y, operators=12, input_offset=0.0, dead_time=0.0).fit
    >>> bool(abs(quality.rmse_percent - 100.0 * quality.rmse / quality.range) < 1e-12)
    True
    """

    @property
    def max_error(self) -> float:
        """Largest absolute error, in the unit of the output."""
    @property
    def rmse(self) -> float:
        """Root mean square error, in the unit of the output."""
    @property
    def mse(self) -> float:
        """Mean square error, in the unit of the output squared."""
    @property
    def range(self) -> float:
        """Peak-to-peak of the measured output over the fitted samples: the base of the percentages."""
    @property
    def max_error_percent(self) -> float:
        """Largest absolute error in % of range."""
    @property
    def rmse_percent(self) -> float:
        """Root mean square error in % of range."""
    @property
    def amplitude(self) -> float:
        """Half of range."""
    @property
    def max_error_percent_of_amplitude(self) -> float:
        """Largest absolute error in % of amplitude."""
    @property
    def rmse_percent_of_amplitude(self) -> float:
        """Root mean square error in % of amplitude."""
    @property
    def nrmse(self) -> float:
        """Normalised root mean square error (NRMSE), rmse / range: sqrt(mean(e**2)) / (max(y) - min(y)).

        Some tools divide by the standard deviation of y instead; this does not.
        """
    @property
    def loop_width(self) -> float | None:
        """Width of the measured loops, by `loop_width`, in the unit of the output; None without full strokes."""
    @property
    def loop_width_error(self) -> float | None:
        """How much wider the modelled loops are; of several records, for the one where it is most."""
    @property
    def samples(self) -> int:
        """How many samples were fitted."""

@final
class LeftOutLoop:
    """One loop of a record, predicted with weights that all loops asked for, and with those of all other loops.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=100)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> found = mh.identify(u, y, operators=6, weights="quadratic", input_offset=0.0, dead_time=0.0)
    >>> loops = found.leave_one_loop_out(u, y)
    >>> len(loops), loops[0].left_out.rmse >= loops[0].fitted.rmse
    (3, True)
    """

    @property
    def record(self) -> int:
        """The number of its record."""
    @property
    def start(self) -> int:
        """Its first sample in that record."""
    @property
    def stop(self) -> int:
        """The sample after its last."""
    @property
    def amplitude(self) -> float:
        """Half the peak-to-peak of the input in it, in the unit of the input."""
    @property
    def fitted(self) -> Quality:
        """The errors with the weights of all loops; range is that of the whole record."""
    @property
    def left_out(self) -> Quality:
        """The errors with the weights of all other loops; range is that of the whole record."""

@final
class Identification:
    """What `identify` found: the model, what follows it, and how well all of it fits.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)  # V
    >>> y = mh.paper.table_1_recovered().forward().run(u)  # um
    >>> found = mh.identify(u, y, dt=0.005, operators=12, input_offset=0.0, dead_time=0.0)
    >>> found.fit.rmse_percent < 0.1, found.stage.drive_range
    (True, (-500.0, 500.0))
    """

    @property
    def model(self) -> _Model:
        """The hysteresis, with the output offset of the first record."""
    @property
    def ratios(self) -> tuple[float, float, float]:
        """The ratios (ra/r, rb/r, rc/r) of the thresholds; (1, 1, 1) for the conventional model."""
    @property
    def stage(self) -> Stage:
        """All of it as a stage, without limits and slew: what precompensation, controllers and plants are made from.

        A stage counts in seconds: of records without dt the dead time is left out, which `stage.identified["warnings"]` says.
        """
    @property
    def dynamics(self) -> _Lag | Modes | None:
        """The linear dynamics behind the hysteresis, of unit static gain, if there are any: FirstOrder or SecondOrder, or Modes if
        there are several.
        """
    @property
    def modes(self) -> list[tuple[float, float, float]]:
        """The modes of second-order dynamics from the lowest frequency up, each (frequency in Hz, damping ratio, gain); the gains
        sum to 1. Empty without such dynamics.
        """
    @property
    def modes_std(self) -> list[tuple[float, float, float]]:
        """Standard errors of `modes`: of frequency, damping ratio and gain of each; a single mode has its gain of 1 without error."""
    @property
    def loop_shift(self) -> LoopShift | None:
        """The loop shift, if there is one."""
    @property
    def creep(self) -> Creep | None:
        """The creep, if there is any."""
    @property
    def amplifier_bandwidth(self) -> float | None:
        """The bandwidth of the amplifier in front of the hysteresis in Hz, if one was found."""

    @property
    def input_map(self) -> tuple[list[float], list[float]] | None:
        """The points (x, y) of the map in front of the hysteresis, if there is one: drive in, drive out."""

    @property
    def output_map(self) -> tuple[list[float], list[float]] | None:
        """The points (x, y) of the map behind the hysteresis, if there is one: position in, position out."""

    @property
    def dead_time(self) -> float | None:
        """What the output lags the input besides, in seconds; None for records without dt."""
    @property
    def dead_time_samples(self) -> float | None:
        """The same in samples; None for records of several sampling intervals."""
    @property
    def lag(self) -> float:
        """How much later slow motion is seen: dead time and lag of the dynamics together, in seconds; in samples without dt."""
    @property
    def dt(self) -> list[float]:
        """The sampling interval of every record in seconds; empty if there is none."""
    @property
    def drive_range(self) -> tuple[float, float]:
        """The lowest and the highest input of all records."""
    @property
    def position_range(self) -> tuple[float, float]:
        """The lowest and the highest output of all fitted samples, ringing and noise included.

        What references may ask for is `stage.position_range`.
        """
    @property
    def noise(self) -> float:
        """Standard deviation of the measurement noise, estimated from the residuals, in the unit of the output."""
    @property
    def output_offsets(self) -> _Vector:
        """The output offset of every record, in the unit of the output."""
    @property
    def fit(self) -> Quality:
        """The errors over the fitted samples of all records."""
    @property
    def records(self) -> list[Quality]:
        """The errors over the fitted samples of each record."""
    @property
    def validation(self) -> Quality | None:
        """The errors over all held-out samples, or None if none were held out."""
    @property
    def validation_records(self) -> list[Quality]:
        """The errors over the held-out samples of each record."""
    @property
    def weights_std(self) -> _Vector:
        """Standard errors of the weights w_i, read-only; NaN where the weight is zero.

        From the fit linearised in weights and searched parameters together. They allow for residuals that are correlated in
        time, and for creep and dynamics that are not in the model (docs/standard_errors.md).
        With smoothness they hold if the true weights are smooth: second differences that scatter about zero as the penalty says.
        """
    @property
    def weights_negative_std(self) -> _Vector:
        """Standard errors of the weights below zero, read-only: those of `weights_std` unless the weights are split."""
    @property
    def ratios_std(self) -> tuple[float, float, float]:
        """Standard errors of the ratios: 0 where given, NaN where at a bound."""
    @property
    def input_offset_std(self) -> float:
        """Standard error of the input offset: 0 if it was given."""
    @property
    def dead_time_std(self) -> float:
        """Standard error of the dead time, in the unit of `lag`: 0 if it was given, NaN at a bound."""
    @property
    def lag_std(self) -> float:
        """Standard error of the lag, in its unit; NaN if a part of it lies at a bound or is not told."""
    @property
    def frequency_std(self) -> float:
        """Standard error of the frequency of the dynamics in Hz, of several modes the first; 0 without any, NaN at a bound."""
    @property
    def damping_std(self) -> float:
        """Standard error of the damping ratio, of several modes that of the first; 0 without one, NaN at a bound."""
    @property
    def loop_shift_std(self) -> _Vector:
        """Standard errors of the amplitudes of the loop shift."""
    @property
    def creep_std(self) -> _Vector:
        """Standard errors of the searched amplitudes of creep."""
    @property
    def parameters(self) -> list[str]:
        """The names of what was estimated, in the order of `covariance`."""
    @property
    def covariance(self) -> _Matrix:
        """The covariance of `parameters`: what was given or lies at a bound is left out."""
    @property
    def cross_validation(self) -> list[tuple[int, float]]:
        """What cross-validation said of the numbers of operators that were tried: pairs (operators, error), the error the geometric
        mean of the rms errors on the stretches that were held out; empty where the number was given.
        """
    @property
    def weights_law(self) -> Literal["free", "quadratic", "split"]:
        """What the weights might be: as given, or as cross-validation chose."""
    @property
    def weights_validation(
        self,
    ) -> list[tuple[Literal["free", "quadratic", "split"], float]]:
        """What cross-validation said of every weight law: pairs (law, error) as in `cross_validation`; empty unless "auto"."""
    @property
    def smoothness(self) -> float:
        """How smooth the weights were asked to be: as given, or as cross-validation chose."""
    @property
    def left_out_samples(self) -> list[list[int]]:
        """The samples of each record that were taken for glitches and left out of the fit, counted from 0 with the skipped ones. They
        enter none of the errors of the fit.
        """
    @property
    def terms_validation(self) -> list[tuple[int, str, float]]:
        """What cross-validation said of the terms that may be left out: (number of amplitudes of creep, loop shift, error as in
        `cross_validation`), the best of every kind, the simplest first; empty if there was nothing to choose.
        """
    @property
    def smoothness_validation(self) -> list[tuple[float, float]]:
        """What cross-validation said of every smoothness: pairs (smoothness, error) as in `cross_validation`; empty unless
        "auto".
        """
    @property
    def kkt_residual(self) -> float:
        """By how much the weights miss the conditions (Karush, Kuhn, Tucker) of the best ones: rounding, 1e-13 or less."""
    @property
    def evaluations(self) -> int:
        """How many passes over the records the search took."""
    @property
    def verdict(self) -> Literal["green", "amber", "red"]:
        """Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`.

        Amber: some numbers are doubtful, or another record would make the result better. Red: this is not the stage.
        """
    @property
    def warnings(self) -> list[Finding]:
        """What these records cannot tell and what the model left in them. docs/findings.md explains every code."""
    @property
    def partial(self) -> bool:
        """Whether Ctrl-C ended the search: the model is the best until then, its weights the best for its thresholds."""
    @overload
    def predict(
        self, u: ArrayLike, *, dt: float | None = None, return_std: Literal[False] = False
    ) -> _Vector:
        """The output for the input `u` from the virgin state and at rest at its first value: through creep, dynamics and dead
        time. `u` is sampled every `dt` seconds, by default like the first record.

        With `return_std=True` a pair: the output, and the standard deviation of every sample of it. That follows from
        the covariance of all that was fitted, linearised at the fit; it allows for residuals that are correlated in time,
        like the standard errors. It tells how far noise may move the prediction; the noise of a measurement comes on top, and
        so does what the model lacks. What was given and what lies at a bound (a
        weight of zero, a ratio at its limit) counts as known, and so does what the records do not tell at all: beyond
        the inputs that they reach, the truth may be further away: a UserWarning says so.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> import numpy as np
        >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
        >>> noise = np.random.default_rng(1).normal(0.0, 0.015, u.size)  # um
        >>> y = mh.paper.table_1_recovered().forward().run(u) + noise
        >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
        >>> predicted, std = found.predict(u, return_std=True)
        >>> predicted.shape == std.shape == u.shape, bool(0 < std.max() < 0.015)
        (True, True)
        """
    @overload
    def predict(
        self, u: ArrayLike, *, dt: None = None, return_std: Literal[True]
    ) -> tuple[_Vector, _Vector]:
        """The output for the input `u` from the virgin state and at rest at its first value: through creep, dynamics and dead
        time. `u` is sampled every `dt` seconds, by default like the first record.

        With `return_std=True` a pair: the output, and the standard deviation of every sample of it. That follows from
        the covariance of all that was fitted, linearised at the fit; it allows for residuals that are correlated in time,
        like the standard errors. It tells how far noise may move the prediction; the noise of a measurement comes on top, and
        so does what the model lacks. What was given and what lies at a bound (a
        weight of zero, a ratio at its limit) counts as known, and so does what the records do not tell at all: beyond
        the inputs that they reach, the truth may be further away: a UserWarning says so.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> import numpy as np
        >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
        >>> noise = np.random.default_rng(1).normal(0.0, 0.015, u.size)  # um
        >>> y = mh.paper.table_1_recovered().forward().run(u) + noise
        >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
        >>> predicted, std = found.predict(u, return_std=True)
        >>> predicted.shape == std.shape == u.shape, bool(0 < std.max() < 0.015)
        (True, True)
        """
    def residuals(
        self,
        u: ArrayLike,
        y: ArrayLike,
        *,
        record: int | None = None,
        skip: _Samples = 0,
        dt: float | None = None,
    ) -> _Vector:
        """Measured minus modelled output of a record, all its samples: (n,) in the unit of y.

        Parameters
        ----------
        u, y : arrays of n floats
            Input and measured output.
        record : int, optional
            The number of the record among those that were fitted, or whose beginning was: then its output offset counts, and the
            creep that was under way when it began. Without it the record has those that suit it best.
        skip : int or str
            Leading samples that do not count for what suits it best, or a time.
        dt : float, optional
            Sampling interval in seconds; by default that of the record, and of the first one without `record`.

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
        >>> y = mh.paper.table_1_recovered().forward().run(u)
        >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
        >>> bool(abs((found.residuals(u, y, record=0) ** 2).mean() ** 0.5 - found.fit.rmse) < 1e-12)
        True
        """
    def leave_one_loop_out(
        self,
        u: ArrayLike | Sequence[tuple[ArrayLike, ArrayLike]],
        y: ArrayLike | None = None,
        *,
        skip: _Samples | Sequence[_Samples] = 0,
        dt: float | Sequence[float] | None = None,
    ) -> list[LeftOutLoop]:
        """Fits the weights anew without each loop of the records, and predicts the loop that was left out.

        A model that only remembers its records does worse there. All else stays as found. A
        loop leads from one maximum of the input to the next; maxima are those from which the input comes down by a
        twentieth of its range at least. What comes before the first maximum of a record belongs to its first loop, what
        comes after the last to its last. Of more than 200 loops, neighbours are left out together.

        Parameters
        ----------
        u, y : arrays of n floats
            The samples that were fitted. Or, for several records, a list of (u, y) pairs alone.
        skip : int or list of int
            Leading samples of each record that were not fitted, or a time.
        dt : float or list of float, optional
            Sampling interval in seconds; by default that of the fitted records.

        Returns
        -------
        list of LeftOutLoop

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came; also for fewer than two loops.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
        >>> y = mh.paper.table_1_recovered().forward().run(u)
        >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
        >>> rows = found.leave_one_loop_out(u, y)
        >>> len(rows), rows[0].start, rows[0].fitted.rmse < rows[0].left_out.rmse
        (10, 0, True)
        """
    def plot(
        self,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
        *,
        record: int | None = None,
        skip: int = 0,
        dt: float | None = None,
        units: _Units = None,
        axes: Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw it with `mpi_hyst.plot.loops`, which has the arguments."""
    def report(
        self,
        path: str | PathLike[str],
        u: ArrayLike | Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
        y: ArrayLike | None = None,
        *,
        skip: int | Sequence[int] = 0,
        names: Sequence[str] | None = None,
        units: _Units = None,
        beside: Identification | None = None,
        validate: _Counted | Sequence[_Counted] | None = None,
    ) -> None:
        """Write a report as one HTML file: `mpi_hyst.reports.identification`, which has the arguments."""
    def _repr_html_(self) -> str: ...

@final
class IterativeLearning:
    """Iterative learning control of a periodic reference: after every period, a better target for the next one.

    A correction v of the target of the feed-forward leaves e = e0 - M v, e = reference - measurement over a period, M the response of
    the feedback loop. At every harmonic a Gaussian tells what is believed of e0 and M; each period makes it narrower. The correction
    moves towards the one with the least mean square of the error to be expected, with P the variance of M and C its covariance with e0:

    v <- Q (v + (conj(M) (e0 - M v) + C - (P + 0.02^2) v) / (|M|^2 + P + 0.02^2 + 0.05^2))

    So little is learned where the loop is not known, and nothing where no error shows above the noise. A loop that is another one than
    was believed is learned with the errors. Learning stops by itself (`finished`). An error of twice the best one is not used: the
    target goes back to the best.

    Parameters
    ----------
    target : array of n floats
        One period of the target: the reference, or what dynamic feed-forward makes of it.
    kp, ki : float
        Gains of the feedback, V/um and V/um/s.
    slope : float
        Of the actuator where it works, um/V: between its w_0 and the sum of its weights.
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series
        The linear dynamics behind the hysteresis.
    dt : float
        Sampling interval in seconds.
    bandwidth : float, optional
        Q = 1 / (1 + (f / bandwidth)^4), in Hz, keeps corrections below it. Without one Q is 1.
    dead_time : float
        What the sensor shows later than the dynamics explain, in seconds.
    min_gain : float
        Old periods are forgotten so fast that the gain never falls below this. Less averages noise over more periods.
    target_limits : (float, float), optional
        The target never leaves (low, high).
    filters : filter or sequence of filters
        Of the feedback.
    noise : float, optional
        The root mean square of the measurement noise, um. Without it the upper half of the harmonics of the first period tells it.
    frequency_uncertainty, damping_uncertainty, slope_uncertainty : float
        How far the true loop may be: a share of the frequency of lightly damped modes, factors of their damping and of the slope.
    settle : int
        Periods that pass before the first one that is learned from, and after each change of the target: one for a lightly damped
        loop. Call `update` for them too.
    on_demand : bool
        The motion is repeated on demand, from rest to rest. If not, one period follows the other. Where the target rests at its ends, up
        to a tenth of it at each, the correction comes and goes smoothly: so nothing jumps there.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import numpy as np
    >>> import mpi_hyst as mh
    >>> stage = mh.plant.SecondOrder(400.0, 0.95)
    >>> reference = np.sin(2 * np.pi * np.arange(100) / 100)
    >>> learning = mh.control.IterativeLearning(
    ...     reference, kp=0.0, ki=0.0, slope=1.0, dynamics=stage, bandwidth=1000.0, dt=1e-4
    ... )
    >>> for _ in range(4):
    ...     position = stage.response(np.tile(learning.target, 3), dt=1e-4)[200:300]
    ...     accepted = learning.update(reference - position)
    >>> bool(learning.rmse[0] > 0.2), bool(learning.rmse[-1] < 1e-3), learning.convergence_rate() < 0.7
    (True, True, True)
    >>> import json
    >>> kept = json.dumps(learning.state)  # for a file; another day
    >>> again = mh.control.IterativeLearning(
    ...     reference, kp=0.0, ki=0.0, slope=1.0, dynamics=stage, bandwidth=1000.0, dt=1e-4
    ... )
    >>> again.state = json.loads(kept)
    >>> bool(np.all(again.target == learning.target))
    True
    """

    def __new__(
        cls,
        target: ArrayLike,
        *,
        kp: float,
        ki: float,
        slope: float,
        dynamics: _Dynamics,
        dt: float,
        bandwidth: float | None = None,
        dead_time: float = 0.0,
        min_gain: float = 0.15,
        target_limits: Sequence[float] | None = None,
        filters: _Filter | Sequence[_Filter] = (),
        noise: float | None = None,
        frequency_uncertainty: float = 0.05,
        damping_uncertainty: float = 2.0,
        slope_uncertainty: float = 1.0,
        settle: int = 0,
        on_demand: bool = False,
    ) -> IterativeLearning: ...
    @property
    def target(self) -> _Vector:
        """One period of the target for the feed-forward, read-only."""
    @property
    def correction(self) -> _Vector:
        """What is added to the target with which learning began: for a reference that also drifts from period to period, as the slow
        axis of a raster does, add it to that. Read-only.
        """
    @property
    def finished(self) -> bool:
        """Whether learning has stopped by itself: five periods did not lower the error by a hundredth. The target is that of the best
        period then. Learning goes on when the error grows by a quarter.
        """
    def update(self, error: ArrayLike) -> bool:
        """Learns from the measured error of a period that was run with the present target; whether it was used, which it is not while the
        loop settles.
        """
    @property
    def max_error(self) -> _Vector:
        """The largest measured error of every period so far."""
    @property
    def rmse(self) -> _Vector:
        """The root mean square of the measured error of every period so far."""
    def convergence_rate(
        self,
        *,
        dynamics: _Dynamics | None = None,
        slope: float | None = None,
        dead_time: float | None = None,
    ) -> float:
        """By how much the error of the slowest harmonic shrinks in the first period, the mean apart: max |Q (1 - L M')|.

        M' is the loop with what is given here instead of what learning believes. Below 1 learning converges.
        """
    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...

@final
class RepetitiveControl:
    """Repetitive control: the correction of the target, learned in the running loop, one period later.

    v(k) = sum_i q_i v(k - N + i) + gain sum_i l_i e(k - N + i) - mean of v, i = -m..m: the filters Q = 1 / (1 + (f / bandwidth)^4)
    and L = conj(M) / (|M|^2 + P + 0.05^2) as finite impulse responses around the present place of the last period of N samples. M is
    the response of the loop to a correction, P its variance over what the loop may be. The static error is left to a feedback that
    integrates.

    Where the loop is too far from the model, learning diverges: the error grows from period to period. It is told by the root mean square
    of the error in a period, or in as many as make 64 samples. Above three times the best (four together) each that is larger than the
    one before counts once, by a half or more twice; a smaller one counts back. At five counts, or where such an error has grown by a half
    beyond half the swing of the reference, learning stops and fades out within one period. What changes of the reference explain does
    not count. Noise or vibration that stays above three times the best error for long may come to five counts by chance.

    Parameters
    ----------
    period : int
        Samples in a period of the reference, 8 to 2^22.
    kp, ki, slope, dynamics, dt, dead_time, filters, frequency_uncertainty, damping_uncertainty, slope_uncertainty
        As for `IterativeLearning`.
    bandwidth : float, optional
        Up to which frequency to learn, in Hz. Without one, as far as learning converges on every loop that the true one may be.
    gain : float
        gamma, above 0 and at most 1: less averages noise over more periods.
    settle : int
        Periods that pass before the first one that is learned from.
    limit : float, optional
        The correction never exceeds this magnitude, in the unit of the displacement.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import math
    >>> import mpi_hyst as mh
    >>> repetitive = mh.control.RepetitiveControl(
    ...     100, kp=0.0, ki=0.0, slope=1.0, dynamics=mh.plant.FirstOrder(50.0), bandwidth=100.0, dt=1e-3
    ... )
    >>> y, decay, errors = 0.0, math.exp(-2 * math.pi * 50.0 * 1e-3), []
    >>> for k in range(3000):
    ...     errors.append(math.sin(2 * math.pi * k / 100) - y)
    ...     target = y + errors[-1] + repetitive.step(errors[-1])
    ...     y = target + decay * (y - target)
    >>> max(errors[:100]) > 0.1, max(errors[-100:]) < 2e-3
    (True, True)
    """

    def __new__(
        cls,
        period: int,
        *,
        kp: float,
        ki: float,
        slope: float,
        dynamics: _Dynamics,
        dt: float,
        bandwidth: float | None = None,
        dead_time: float = 0.0,
        gain: float = 0.3,
        settle: int = 1,
        limit: float | None = None,
        filters: _Filter | Sequence[_Filter] = (),
        frequency_uncertainty: float = 0.05,
        damping_uncertainty: float = 2.0,
        slope_uncertainty: float = 1.0,
    ) -> RepetitiveControl: ...
    def step(self, error: float, reference: float | None = None) -> float:
        """Takes the measured error of this sample and returns the correction of this sample's target.

        With the reference of this sample, errors that come from a reference that changes are not taken for divergence.
        """
    @property
    def phase(self) -> _LearningPhase:
        """ "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing until `restart`."""
    @property
    def divergence_count(self) -> int:
        """How often learning has diverged, and stopped."""
    def restart(self) -> None:
        """Learns anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing jumps."""
    def reset(self) -> None:
        """Forgets everything, the counters too."""
    @property
    def period(self) -> int:
        """Samples in a period."""
    @property
    def bandwidth(self) -> float:
        """Up to which frequency it learns, in Hz."""
    @property
    def rejected(self) -> int:
        """How many errors were not finite: they teach nothing."""
    def convergence_rate(
        self,
        *,
        dynamics: _Dynamics | None = None,
        slope: float | None = None,
        dead_time: float | None = None,
    ) -> float:
        """By how much the error shrinks in a period at the worst frequency from the first harmonic up: max |Q - gain L M'|.

        M' is the loop with what is given here instead of what is believed. Below 1 the loop is stable with learning.
        """
    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...

@final
class Observer:
    """A state observer: what the model of a stage and a noisy measurement say together of the position.

    The applied drive moves the model of the stage, which has no lag for what it knows. What it does not know (drift, its own
    error) is a disturbance at the input of the modes that wanders by `drift`; a Kalman filter estimates it from the difference
    between measurement and model. Feed the estimate to the controller instead of the measurement. Where measurements are
    missing the gain is that of what is known then, and comes back to the stationary one.

    Parameters
    ----------
    stage : Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        A model with the keywords `dynamics` and `dead_time` makes a stage.
    drift : float
        By how much what the model does not know changes in one second, root mean square, in the unit of the position.
    dt : float
        Sampling interval in seconds.
    noise : float, optional
        Root mean square of the measurement noise, in the unit of the position; by default that of the stage.
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
    dead_time : float
        What the sensor shows later than hysteresis and dynamics explain, in seconds.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016)
    >>> observer = mh.control.Observer(stage, drift=0.5, dt=1e-4)
    >>> estimate = observer.step(0.0, 0.1)  # at rest, a first sample that is mostly noise
    >>> 0.0 < estimate < 0.02
    True
    """

    def __new__(
        cls,
        stage: _Model | Stage,
        *,
        drift: float,
        dt: float,
        noise: float | None = None,
        dynamics: _Dynamics | None = None,
        dead_time: float = 0.0,
    ) -> Observer: ...
    def step(self, drive: float, measurement: float) -> float:
        """Takes the drive that was held since the last sample, and the measurement of now; returns the position of now.

        Without a finite measurement the model goes on alone; that is counted. One that was in a loop has taken the drive that is held
        now: its next step goes on from that.
        """
    def run(
        self, drives: ArrayLike, measurements: ArrayLike, out: _Vector | None = None
    ) -> _Vector:
        """Takes arrays of drives and measurements, bit for bit like `step` in a loop; returns the positions, in `out` or a new array."""
    @property
    def disturbance(self) -> float:
        """What the model does not know, at the input of the modes, in the unit of the position."""
    @property
    def position_gain(self) -> float:
        """What the position takes of the difference between measurement and prediction, from 0 to 1."""
    @property
    def disturbance_gain(self) -> float:
        """What the disturbance takes of the difference between measurement and prediction."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    @property
    def rejected(self) -> int:
        """How many drives or measurements were not finite; before a controller, also how many of its measurements were implausible."""
    def reset(self) -> None:
        """Back to rest."""
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first, one per sampling interval, without measurements."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...

@final
class RecursiveIdentifier:
    """The weights of a model that follow a running actuator: recursive least squares with forgetting.

    y(k) = output_offset + sum_i w_i z_i(k), y(k) read as u(k) is put out, z_i the operators of `model` at u - input_offset: thresholds stay, weights and
    output offset are estimated, sample by sample, from the virgin state. With forgetting = 1 the estimate is that of least
    squares over all samples (to 1e-13 um/V on the paper's actuator). The weights of `.model` are the nearest to the
    estimate that are not negative, the identity weight at least 1e-6 of the given one, so its inverse exists at every
    sample; `Inverse.set_model` takes it into a running inverse without a jump of the drive.

    Parameters
    ----------
    model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        Where to start; invertible.
    forgetting : float
        What a sample counts after the next one, from 0.5 to 1: the memory is 1 / (1 - forgetting) samples long.
    output_offset : "fit" or float
        Fit the offset of the sensor as one more unknown, starting from that of the model, or hold it at a value.
    covariance : float
        Variance of every unknown at the start, in units of the variance of the measurement noise; the unknowns are w_i X
        and the output offset, X the largest threshold rounded up to a power of two. By default the samples alone decide;
        with 1 the model counts as one sample of full range.
    covariance_limit : float
        The variance that forgetting may bring back where nothing is excited, in the same units.
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
        What lies between the hysteresis and the measurement. Without any, y follows u at once.
    dead_time : float
        What y lags u besides, in seconds.
    dt : float, optional
        Sampling interval in seconds, which dynamics and dead time need.

    Raises
    ------
    NotInvertibleError, ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> plant = mh.paper.table_1_recovered().forward()
    >>> identifier = mh.RecursiveIdentifier(mh.paper.table_1(), forgetting=0.999)
    >>> for u in mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1000):
    ...     error = identifier.update(u, plant.step(u))
    >>> bool(abs(identifier.model.weights - mh.paper.table_1_recovered().weights).max() < 1e-7)
    True
    >>> abs(error) < 1e-9, identifier.frozen  # the drive has died out
    (True, 'poor_excitation')
    """

    def __new__(
        cls,
        model: _Model,
        *,
        forgetting: float = 1.0,
        output_offset: Literal["fit"] | float = "fit",
        covariance: float = 1e12,
        covariance_limit: float = 1e4,
        dynamics: _Dynamics | None = None,
        dead_time: float = 0.0,
        dt: float | None = None,
    ) -> RecursiveIdentifier: ...
    def update(self, u: float, y: float) -> float:
        """Takes the input u and the output y read as u is put out; the prediction error: y minus what `model` predicted before.

        A sample that is not finite changes no weight and gives the last error again; a good u moves the operators all the
        same.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over the drives before, oldest first: operators and dynamics move, nothing is learned."""
    @property
    def model(self) -> _Model:
        """The model as of the last sample: the given one with other weights and output offset."""
    @property
    def frozen(self) -> Literal["poor_excitation", "not_finite"] | None:
        """Why the last sample changed no weight: None if it did, else one word.

        "poor_excitation": it says less than forgetting would lose, as at standstill (its leverage z'Pz is below
        1.25 (1 - forgetting)); nothing is forgotten meanwhile. "not_finite": input or output is NaN, infinite or beyond
        1e100.
        """
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""
    @property
    def forgetting(self) -> float:
        """What a sample counts after the next one."""
    @property
    def covariance(self) -> _Matrix:
        """The covariance of the estimate: a matrix over the weights, then the output offset if it is fitted.

        Of a split model the w_i come first, then the v_i, but for an identity that weighs the same on both sides.

        In units of the variance of the measurement noise: times that, the diagonal is the variance of each.
        """
    def reset(self) -> None:
        """Back to the given model, the operators at rest."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...

@final
class Preview:
    """Makes the target of a `HybridController` of references known beforehand, by a fixed window.

    target(k) = sum_j c_j r(k + ahead - j), j = 0 the newest. References then enter `step` `ahead` samples early; the
    feedback uses r(k), from the same window, which at the start is full of the first reference.

    While the window fills anew, at the start, after a hold and after a rejected reference, the target rests at the first
    reference.

    Parameters
    ----------
    coefficients : array of shape (taps,)
        c_j, that of the newest reference first.
    ahead : int
        How many samples the references are early: less than there are taps.
    dt : float, optional
        The sampling interval in seconds for which the window was made: a controller of another one then refuses it.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> half_a_sample = mh.control.Preview([0.5, 0.5], 1)
    >>> controller = mh.control.HybridController(
    ...     None, kp=5.0, ki=6e3, dt=1e-4, limits=(-500, 500), preview=half_a_sample)
    >>> for reference in (1.0, 2.0, 3.0):
    ...     drive = controller.step(reference, 0.0)
    >>> controller.terms.reference, controller.terms.target
    (2.0, 2.5)
    """

    def __new__(cls, coefficients: ArrayLike, ahead: int, dt: float | None = None) -> Preview: ...
    @property
    def coefficients(self) -> _Vector:
        """The coefficients c_j, read-only."""
    @property
    def dt(self) -> float | None:
        """The sampling interval in seconds for which it was made, or None: a controller of another one refuses it."""
    @property
    def ahead(self) -> int:
        """How many samples the references are early."""
    @property
    def smoothing(self) -> float | None:
        """Over how many seconds references are smoothed, or None."""
    def smoothed(self, seconds: float) -> Preview:
        """The same behind a smoothing of the references: three means of a third of `seconds`, one behind the other.

        Target and reference of the feedback are then those of the smoothed references, which come half of `seconds` earlier. So
        references may have steps and corners. Means over a period of a resonance leave it at rest: three periods of the slowest one
        are a good choice.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> preview = mh.control.preview(mh.plant.SecondOrder(800.0, 0.02), 1e-4, ahead=4)
        >>> smoothed = preview.smoothed(3.7e-3)
        >>> preview.ahead, smoothed.ahead, smoothed.smoothing
        (4, 21, 0.0037)
        """
    def error(self, frequency: float) -> float:
        """The error of the position for a sine of this frequency in Hz, relative to the sine, or to the smoothed one.

        Only `mpi_hyst.control.preview` knows which dynamics its coefficients invert: a ValueError for coefficients alone.
        """

@final
class Notch:
    """A notch, which takes out a resonance and leaves slow signals as they are.

    (s^2 + 2 depth w s + w^2) / (s^2 + 2 width w s + w^2), w = 2 pi frequency. At its frequency it passes depth / width. With the
    damping ratio of a mode for the depth it puts a mode of the damping ratio `width` in its place.

    Parameters
    ----------
    frequency : float
        In Hz, below half of the sampling rate.
    depth : float
        Damping ratio of its zeros, 0 to 100.
    width : float
        Damping ratio of its poles, above 0: a wide notch bears more uncertainty of the frequency, and lags more.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> notch = mh.control.Notch(800.0, 0.02, 1.0)
    >>> abs(notch.response([0.0, 800.0], dt=1e-4)).round(3)
    array([1.  , 0.02])
    """

    def __new__(cls, frequency: float, depth: float, width: float) -> Notch: ...
    @property
    def frequency(self) -> float:
        """In Hz."""
    @property
    def depth(self) -> float:
        """Damping ratio of its zeros."""
    @property
    def width(self) -> float:
        """Damping ratio of its poles."""
    def section(self, dt: float) -> Biquad:
        """The section for a sampling interval, by the bilinear transform, prewarped at its own frequency."""
    def response(self, frequencies: ArrayLike, dt: float) -> _Complex:
        """The complex response at frequencies in Hz, for a sampling interval."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class LowPass:
    """A low-pass of unit static gain: w / (s + w), or w^2 / (s^2 + 2 zeta w s + w^2) with a damping ratio.

    Behind one a small negative `kp` damps a mode: integral resonant control, or positive position feedback for one of second order.

    Parameters
    ----------
    frequency : float
        Cut-off frequency in Hz, below half of the sampling rate.
    damping : float, optional
        Damping ratio zeta of one of second order.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> slow = mh.control.LowPass(200.0)
    >>> abs(slow.response([0.0, 200.0, 5000.0], dt=1e-4)).round(3)
    array([1.   , 0.707, 0.   ])
    """

    def __new__(cls, frequency: float, damping: float | None = None) -> LowPass: ...
    @property
    def frequency(self) -> float:
        """Cut-off frequency in Hz."""
    @property
    def damping(self) -> float | None:
        """Damping ratio; None for first order."""
    def section(self, dt: float) -> Biquad:
        """The section for a sampling interval, by the bilinear transform, prewarped at its own frequency."""
    def response(self, frequencies: ArrayLike, dt: float) -> _Complex:
        """The complex response at frequencies in Hz, for a sampling interval."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Lead:
    """A lead, which adds phase between two frequencies: (1 + s / w_zero) / (1 + s / w_pole).

    Parameters
    ----------
    zero, pole : float
        In Hz, below half of the sampling rate. With the zero above the pole it is a lag.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> lead = mh.control.Lead(100.0, 900.0)
    >>> abs(lead.response([0.0, 300.0], dt=1e-5)).round(2)
    array([1., 3.])
    """

    def __new__(cls, zero: float, pole: float) -> Lead: ...
    @property
    def zero(self) -> float:
        """In Hz."""
    @property
    def pole(self) -> float:
        """In Hz."""
    def section(self, dt: float) -> Biquad:
        """The section for a sampling interval, by the bilinear transform, prewarped at its own frequency."""
    def response(self, frequencies: ArrayLike, dt: float) -> _Complex:
        """The complex response at frequencies in Hz, for a sampling interval."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Biquad:
    """A second-order section: y(k) = b0 u(k) + b1 u(k-1) + b2 u(k-2) - a1 y(k-1) - a2 y(k-2).

    Parameters
    ----------
    b : (b0, b1, b2)
    a : (a1, a2)
        Both poles lie inside the unit circle. A row of `scipy.signal` second-order sections has 1 before these.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.control.Biquad([0.5, 0.5, 0.0], [0.0, 0.0]).response([0.0, 2500.0], dt=1e-4).round(3)
    array([1. +0.j , 0.5-0.5j])
    """

    def __new__(cls, b: Sequence[float], a: Sequence[float]) -> Biquad: ...
    @property
    def b(self) -> tuple[float, float, float]:
        """b0, b1 and b2."""
    @property
    def a(self) -> tuple[float, float]:
        """a1 and a2."""
    def section(self, dt: float) -> Biquad:
        """The section for a sampling interval, by the bilinear transform, prewarped at its own frequency."""
    def response(self, frequencies: ArrayLike, dt: float) -> _Complex:
        """The complex response at frequencies in Hz, for a sampling interval."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

_Filter: TypeAlias = Notch | LowPass | Lead | Biquad

@final
class Filter:
    """Filters that run, sample by sample, from rest at zero: of a measurement, say, before anything else sees it.

    Parameters
    ----------
    filters : Notch, LowPass, Lead, Biquad, or a list of them
        At most 6.
    dt : float
        Sampling interval in seconds.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> slow = mh.control.Filter(mh.control.LowPass(500.0), dt=1e-4)
    >>> slow.run([1.0, 1.0, 1.0]).round(4)
    array([0.1367, 0.3728, 0.5443])
    >>> slow.settle(1.0)
    >>> round(slow.step(1.0), 12)
    1.0
    """

    def __new__(cls, filters: _Filter | Sequence[_Filter], dt: float) -> Filter: ...
    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""
    @property
    def filters(self) -> tuple[Biquad, ...]:
        """The filters, as sections."""
    def set_filters(self, filters: _Filter | Sequence[_Filter]) -> None:
        """Changes the filters without a jump: with the same input the output stays as it was, and goes on from there."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    def settle(self, input: float) -> None:
        """Comes to rest at an input, as if it had always been the same."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the filters remember, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, value: dict[str, Any]) -> None: ...

@final
class ControllerTerms:
    """What a sample of a `HybridController` was made of: positions in um, terms in volts.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
    >>> controller = stage.controller(dt=1e-4)
    >>> drive = controller.step(1.0, 0.25)  # um, um
    >>> controller.terms.error, controller.terms.drive == drive
    (0.75, True)
    """

    @property
    def reference(self) -> float:
        """The reference of the feedback."""
    @property
    def target(self) -> float:
        """What the feed-forward was to reach."""
    @property
    def error(self) -> float:
        """Reference minus measurement; without a usable measurement the last one there was."""
    @property
    def filtered_error(self) -> float:
        """The error behind the filters."""
    @property
    def feedforward(self) -> float:
        """The output of the feed-forward, or the number given instead."""
    @property
    def proportional(self) -> float:
        """kp times the filtered error."""
    @property
    def integral(self) -> float:
        """The sum of ki dt times the filtered errors, this sample included."""
    @property
    def bumpless(self) -> float:
        """What keeps starts and switches from being jumps; it goes to zero."""
    @property
    def unlimited_drive(self) -> float:
        """What the law asks for: the sum of the four terms."""
    @property
    def drive(self) -> float:
        """What the limiter lets through."""
    @property
    def saturated(self) -> bool:
        """Whether the unlimited drive lay beyond the limits."""
    @property
    def slewing(self) -> bool:
        """Whether the unlimited drive was farther from the last drive than the slew allows."""

_FeedForward: TypeAlias = Forward | Inverse | StageInverse | Literal["given"] | None

@final
class ArrayController:
    """Feed-forward through the exact inverses of M actuators and an integral behind a reconstruction matrix, within limits at every
    sample: made by `array.controller(...)`.

    a(k) = a(k-1) + dt (ki e(k) - leak a(k-1)), e = R (sensor reference - measurement), target(k) = reference(k) + a(k) +
    bumpless(k), drive of actuator i = H_i^-1[target_i]. Reference, integral a and bumpless term are displacements. With a
    `reconstruction` matrix R of shape (M, S) the sensor reference is zero unless it is given, so the feedback brings the sensors
    to zero. Without one sensor i measures actuator i, and the sensor reference is the reference. ki and leak are per second:
    behind the exact inverse the loop is linear, so one gain suits all actuators.

    The drives are always finite, within their limits, and no farther than slew dt from the last ones. The inverses remember the
    drives that go out. Where limits hold an actuator back, its integral takes of its change what the actuator can follow. The
    modelled positions of neighbours are never farther apart than `max_difference`; where they are already, at the start, the
    difference never grows.

    A motion starts from the present drives: at the first sample, after a reset, a hold or a stop, and after a sample that was
    rejected. `bumpless` takes the difference and goes to zero in a straight line.

    A reference that is not finite (or beyond 1e100) holds all drives. A measurement that is not finite lets the integral rest:
    that of its actuator without a matrix, all of them with one. Feed-forward goes on.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> mirror = mh.ActuatorArray([mh.paper.table_1_recovered()] * 3)
    >>> influence = np.array([[1.0, 0.3, 0.0], [0.3, 1.0, 0.3], [0.0, 0.3, 1.0], [0.2, 0.0, 0.2]])  # 4 sensors
    >>> controller = mirror.controller(1e-3, (-500.0, 500.0), ki=200.0, reconstruction=np.linalg.pinv(influence))
    >>> plant, wavefront = mirror.forward(), np.zeros(4)
    >>> for k in range(200):
    ...     drives = controller.step(np.zeros(3), wavefront)
    ...     wavefront = influence @ (plant.step(drives) - [0.5, -0.2, 0.1])  # what is to be flattened
    >>> bool(abs(wavefront).max() < 1e-6)
    True
    >>> np.round(controller.position, 6)
    array([ 0.5, -0.2,  0.1])
    """

    def step(
        self,
        reference: ArrayLike,
        measurement: ArrayLike | None = None,
        *,
        sensor_reference: ArrayLike | None = None,
        out: _Vector | None = None,
    ) -> _Vector:
        """Takes a sample and gives the drives, an array of shape (M,), in `out` or a new array.

        `reference`: the positions that are wanted, shape (M,). `measurement`: what the sensors show, shape (S,); None for
        feed-forward alone, the integral staying as it is. `sensor_reference`: what the sensors are to show, shape (S,); by default
        zero, or the reference if there is no reconstruction matrix.
        """
    def peek(
        self,
        reference: ArrayLike,
        measurement: ArrayLike | None = None,
        *,
        sensor_reference: ArrayLike | None = None,
        out: _Vector | None = None,
    ) -> _Vector:
        """The drives that `step` would give, without taking the sample."""
    def run(
        self,
        reference: ArrayLike,
        measurement: ArrayLike | None = None,
        *,
        sensor_reference: ArrayLike | None = None,
        out: _Matrix | None = None,
    ) -> _Matrix:
        """Takes rows of samples, bit for bit like `step` in a loop: `reference` of shape (samples, M), `measurement` and
        `sensor_reference` of shape (samples, S). The drives, of shape (samples, M), come in `out` or a new array.
        """
    @property
    def drive(self) -> _Vector:
        """The present drives: what the amplifiers have."""
    @property
    def position(self) -> _Vector:
        """Where the models are at the present drives."""
    @property
    def integral(self) -> _Vector:
        """The integral of every actuator, a displacement."""
    @property
    def limits(self) -> _Matrix:
        """The limits (low, high) of the drives, an array of shape (M, 2)."""
    @property
    def sensors(self) -> int:
        """The number of sensors S."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    @property
    def ki(self) -> float:
        """The integral gain per second."""
    @property
    def leak(self) -> float:
        """How fast the integral goes to zero by itself, per second."""
    @property
    def mode(self) -> Literal["run", "hold", "stop"]:
        """ "run"; "hold": the drives stay; "stop", which `stop` begins."""
    @property
    def hold(self) -> bool:
        """Whether the drives are held. An attribute: set it to True to hold, to False to go on, also after a stop."""
    @hold.setter
    def hold(self, hold: bool) -> None: ...
    @property
    def rejected_count(self) -> int:
        """How many samples had a reference that is not finite, or beyond 1e100: all drives were held."""
    @property
    def missing_count(self) -> int:
        """How many samples had a measurement that is not finite, or beyond 1e100."""
    @property
    def saturated_count(self) -> int:
        """How many drives a target out of reach brought to a limit: of all actuators together."""
    @property
    def slewing_count(self) -> int:
        """How many drives the slew held back: of all actuators together."""
    @property
    def pair_limited_count(self) -> int:
        """In how many samples the limits of differences moved at least one target."""
    def set_gains(self, ki: float, leak: float | None = None) -> None:
        """Changes the gains, per second, without a jump. The leak stays unless it is given."""
    def set_model(self, actuator: int, model: _Model) -> None:
        """One actuator goes on with the weights and the output offset of another model of the same thresholds and input offset,
        without a jump.

        Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the controller is
        as before then.
        """
    def stop(self, rate: float, rest_drive: ArrayLike = 0.0) -> None:
        """Ramps the drives to `rest_drive` (V), one for all or one for each, at `rate` (V/s), or at the slew if that is slower, and
        holds them there.

        From the next sample on every `step` puts out the next drives of the ramp, for any reference and measurement. `hold =
        False` starts a motion from the drives that are reached then.
        """
    def reset(self, drive: ArrayLike | None = None) -> None:
        """Back to the start, in mode "run", with the memory of a move from rest to the present drives and all counters at zero. The
        drives stay as they are, or are `drive`, one for all or one for each, if the amplifiers have others now.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, an array of shape (samples, M), oldest drives first; the next motion starts from the
        last row.
        """
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit. The
        amplifiers must be at its drives. A controller with other gains or dt refuses it; models and limits are not part of it.
        """
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    def __len__(self) -> int: ...

@final
class HybridController:
    """Feed-forward and proportional-integral feedback within limits: equation (8) of the paper with its errata 10 to 12.

    u(k) = H^-1[target(k)] + kp e(k) + ki dt (e(0) + ... + e(k)) + bumpless(k), e = F (reference - measurement) with the
    filters F. The drive is always finite, within `limits`, and no farther than slew dt from the last one. A motion starts from the present drive, and
    no change while it runs is a jump: `bumpless` takes the difference and goes to zero in a straight line.

    A reference, target or feed-forward that is not finite (or beyond 1e100) repeats the last drive and is counted. So does a
    measurement that is not finite, out of `measurement_range`, or farther than `max_measurement_step` from the last one;
    after `max_missing` of these in a row feed-forward goes on alone, the integral frozen, until a plausible one returns. While
    `bumpless` has not gone to zero since the drive was held last, the last error stands in: however many are lost,
    the drive goes on.

    Parameters
    ----------
    feedforward : Inverse, StageInverse, Forward, "given" or None
        model.inverse(limits) or stage.inverse(dt), the exact inverse, with the limits of the controller; or model.forward() of
        a model that is itself an inverse, um in and volts out (Table II, a closed form). The controller goes on with a copy,
        memory included. "given": volts that come with every sample. None: feedback alone.
    kp, ki : float
        Gains in V/um and V/um/s. They are not negative, but for kp behind filters: that is active damping.
    dt : float
        The sampling interval in seconds.
    limits : (low, high)
        Of the drive, in volts.
    slew : float, optional
        How fast the drive may move, in V/s.
    law : "positional" or "incremental"
        Equation (8) as it must be meant; or from the last drive on, u += change of H^-1 + kp (change of e) + ki dt e, which
        loses what a limit cuts off.
    anti_windup : "conditional" or "back_calculation"
        Of the positional law, for limits and slew: the integral takes no error that pushes a limited drive further; or it also
        takes what was cut off, over `tracking_time` seconds (by default the integral time kp / ki).
    tracking_time : float, optional
        For back-calculation alone, in seconds.
    bumpless_time : float
        How long, in seconds, the difference at a start or a switch takes to go to zero. From a start on the integral rests for
        that time.
    max_missing : int
        How many measurements in a row may be missing or implausible before feed-forward goes on alone. The first of them holds the
        drive; where losses follow each other within `bumpless_time`, the last error stands in.
    measurement_range : (low, high), optional
        What the sensor can show.
    max_measurement_step : float, optional
        The largest plausible change from one measurement to the next. After k measurements in a row that could not be used,
        k + 1 times as much is plausible; after `max_missing` of them the next finite one within `measurement_range` is taken,
        wherever it is.
    preview : Preview, optional
        Makes the target of references that then come `preview.ahead` samples early.
    start_drive : float, optional
        The drive that the amplifier has at the start: by default zero or the limit nearest to it.
    filters : Notch, LowPass, Lead, Biquad, or a list of them
        F shapes the error before both gains. At most 6.
    observer : Observer, optional
        The feedback sees what it makes of measurement and drive. For up to `max_missing` measurements in a row that are missing or
        implausible it stands in; they are counted all the same. The controller goes on with a copy, memory included. It keeps its model
        when `set_model` changes that of the feed-forward, and takes the difference for a disturbance.
    repetitive : RepetitiveControl, optional
        Learns a correction of the target from the errors of the last period, while the feedback is on and no start or hold is still
        under way. For a feed-forward that a target reaches. The controller goes on with a copy, whose filters stay those of the gains
        that it was made for. If it diverges it stops and fades out: see `learning_phase` and `divergence_count`.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> model, limits = mh.paper.table_1_recovered(), (-500.0, 500.0)
    >>> controller = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=6e3, dt=1e-4, limits=limits)
    >>> actuator, position = model.forward(), 0.0  # an ideal one: no dynamics, no noise
    >>> for reference in mh.signals.sine(2.0, 10.0, seconds=0.2, rate=10_000):  # um
    ...     position = actuator.step(controller.step(reference, position))
    >>> abs(controller.terms.error) < 0.03  # one sample of motion: the measurement is the last one
    True
    >>> controller.hold = True
    >>> controller.step(3.0, position) == controller.drive == controller.terms.drive
    True
    >>> controller.hold = False
    >>> drive = controller.plan(3.0, position)  # changes nothing until it is committed
    >>> controller.commit(), controller.drive == drive
    (True, True)
    """

    def __new__(
        cls,
        feedforward: _FeedForward,
        *,
        kp: float,
        ki: float,
        dt: float,
        limits: Sequence[float],
        slew: float | None = None,
        law: Literal["positional", "incremental"] = "positional",
        anti_windup: Literal["conditional", "back_calculation"] = "conditional",
        tracking_time: float | None = None,
        bumpless_time: float = 0.005,
        max_missing: int = 10,
        measurement_range: Sequence[float] | None = None,
        max_measurement_step: float | None = None,
        preview: Preview | None = None,
        start_drive: float | None = None,
        filters: _Filter | Sequence[_Filter] = (),
        observer: Observer | None = None,
        repetitive: RepetitiveControl | None = None,
    ) -> HybridController: ...
    @property
    def filters(self) -> tuple[Biquad, ...]:
        """The filters of the feedback, as sections."""
    @property
    def measurement_range(self) -> tuple[float, float] | None:
        """Measurements outside this range (low, high) count as missing; None without such a gate."""
    @property
    def max_measurement_step(self) -> float | None:
        """Measurements farther than this from the last good one count as missing; None without such a gate."""
    @property
    def preview(self) -> Preview | None:
        """The preview, or None."""
    @property
    def observer(self) -> Observer | None:
        """The observer before the feedback, as a copy in its present state, or None. It has taken the present drive."""
    @property
    def repetitive(self) -> RepetitiveControl | None:
        """Learning in the loop, as a copy in its present state, or None."""
    @property
    def learning_phase(self) -> _LearningPhase | None:
        """ "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing until
        `restart_learning` or `reset`. None without learning.
        """
    @property
    def divergence_count(self) -> int:
        """How often learning has diverged: the error grew from period to period, on a stage that is too far from the model. It has stopped
        and faded out then.
        """
    def restart_learning(self) -> None:
        """Lets learning begin anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing jumps.

        Raises ValueError for a controller that does not learn.
        """
    def step(
        self,
        reference: float,
        measurement: float,
        feedforward: float | None = None,
        *,
        target: float | None = None,
        correction: float = 0.0,
    ) -> float:
        """Takes a sample and returns the drive in volts.

        `reference` and `measurement` in um, with a preview the reference of `preview.ahead` samples later; `feedforward`:
        volts that replace the output of the source, which follows the target all the same; `target`: what the feed-forward
        is to reach, if not the reference or what the preview makes of it; `correction`: what is added to that, as
        `IterativeLearning.correction`.
        """
    def run(
        self, references: ArrayLike, measurements: ArrayLike, out: _Vector | None = None
    ) -> _Vector:
        """Takes arrays of references and measurements, bit for bit like `step` in a loop; returns the drives, in `out` or a new array."""
    def peek(
        self,
        reference: float,
        measurement: float,
        feedforward: float | None = None,
        *,
        target: float | None = None,
        correction: float = 0.0,
    ) -> float:
        """The drive that `step` would return, without taking the sample."""
    def plan(
        self,
        reference: float,
        measurement: float,
        feedforward: float | None = None,
        *,
        target: float | None = None,
        correction: float = 0.0,
    ) -> float:
        """The drive for a sample, which only `commit` takes: write it to the amplifier between the two, and if that fails,
        leave it; memory and terms are still those of the drive that is there.

        A plan replaces the one before; any change of the controller drops it.
        """
    def commit(self) -> bool:
        """Takes the sample that was planned; False if there is none."""
    @property
    def drive(self) -> float:
        """The present drive in volts: what the amplifier has."""
    @property
    def terms(self) -> ControllerTerms:
        """What the last sample that was acted upon was made of."""
    @property
    def mode(self) -> Literal["run", "feedforward", "hold", "stop"]:
        """ "run"; "feedforward": the proportional term is off, the integral is frozen and stays part of the drive; "hold": the
        drive stays and nothing advances; "stop", which `stop` begins. Set one of the first three at any time: no change of
        mode is a jump.
        """
    @mode.setter
    def mode(self, mode: Literal["run", "feedforward", "hold"]) -> None: ...
    @property
    def hold(self) -> bool:
        """Whether the drive is held. An attribute: set it to True to hold, to False to go on in the mode before, also after a
        stop.
        """
    @hold.setter
    def hold(self, hold: bool) -> None: ...
    def stop(self, rate: float, rest_drive: float = 0.0) -> None:
        """Ramps the drive to `rest_drive` (V) at `rate` (V/s), or at the slew if that is slower, and holds it there.

        From the next sample on every `step` puts out the next drive of the ramp, for any reference and measurement. `hold = False` starts a motion
        from the drive that is reached then.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first, one per sampling interval; the next motion starts from the last."""
    @property
    def lead_in(self) -> float:
        """For how many seconds at most the drive is not yet that of the law, from the next sample on: until the window of the
        preview is full and the bumpless term is gone.
        """
    @property
    def kp(self) -> float:
        """The proportional gain in V/um."""
    @property
    def ki(self) -> float:
        """The integral gain in V/um/s."""
    @property
    def limits(self) -> tuple[float, float]:
        """The limits of the drive (low, high) in volts."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    def set_gains(self, kp: float, ki: float) -> None:
        """Changes the gains without a jump. The integral is kept in volts."""
    def set_filters(self, filters: _Filter | Sequence[_Filter]) -> None:
        """Changes the filters of the feedback without a jump: what they put out stays as it was, and goes on from there."""
    def set_model(self, model: _Model) -> None:
        """Goes on with the weights and the output offset of another model of the same operators, without a jump: as
        `Inverse.set_model` or `Forward.set_model` of the feed-forward.

        Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the
        controller is as before then.
        """
    def set_feedforward(self, feedforward: _FeedForward) -> None:
        """Goes on with another feed-forward (as at construction) without a jump. While a motion is under way the new stream
        first moves to the last target; a change to "given" repeats the drive for one sample.
        """
    def reset(self, drive: float | None = None) -> None:
        """Back to the start, in mode "run", with the memory of the feed-forward at rest and all counters at zero. The drive
        stays as it is, or is `drive` if the amplifier has another one now.
        """
    @property
    def rejected_count(self) -> int:
        """How many references, targets or given feed-forwards were not finite, or beyond 1e100, or missing."""
    @property
    def missing_count(self) -> int:
        """How many measurements were not finite, or beyond 1e100."""
    @property
    def implausible_count(self) -> int:
        """How many measurements were finite but out of their range, or too far from the last one."""
    @property
    def saturated_count(self) -> int:
        """How many samples asked for a drive beyond the limits."""
    @property
    def slewing_count(self) -> int:
        """How many samples asked for a faster move than the slew allows."""
    def start_at(self, drive: float) -> None:
        """Goes on from another drive that the amplifier has, with everything that is remembered.

        For a state that was loaded into a controller whose amplifier is not at its drive: the next motion starts from there.
        """
    def state_bytes(self) -> bytes:
        """What `state` says, as bytes: `state` takes them too."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit. The
        amplifier must be at its drive. A controller with other gains, dt or limits refuses it; the model is not part of it.
        """
    @state.setter
    def state(self, state: dict[str, Any] | bytes) -> None: ...

_Counted: TypeAlias = tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, int]
_HeldOut: TypeAlias = _Counted | tuple[ArrayLike, ArrayLike, str]

_Records: TypeAlias = ArrayLike | Sequence[tuple[ArrayLike, ArrayLike]]
_Samples: TypeAlias = int | str

def identify(
    u: _Records,
    y: ArrayLike | None = None,
    *,
    dt: float | Sequence[float] | None = None,
    times: ArrayLike | Sequence[ArrayLike | None] | None = None,
    model: Literal["modified", "conventional"] = "modified",
    operators: int | Literal["auto"] | None = None,
    weights: Literal["auto", "free", "quadratic", "split"] = "auto",
    ratios: Literal["fit"] | tuple[float, float, float] = "fit",
    input_offset: Literal["fit"] | float = "fit",
    dead_time: Literal["fit"] | float = "fit",
    dynamics: Literal["auto", 1, 2] | None = "auto",
    modes: Literal["auto", 1, 2, 3] = "auto",
    creep: Literal["auto", "log"] | int | ArrayLike | None = "auto",
    loop_shift: Literal["auto"] | float | None = "auto",
    amplifier: Literal["auto"] | float | None = "auto",
    input_map: Literal["auto", "smooth"] | None = "auto",
    output_map: Literal["auto", "smooth"] | None = "auto",
    thresholds: Literal["uniform", "quantiles", "geometric"] | ArrayLike | None = None,
    smoothness: Literal["auto"] | float = "auto",
    loss: Literal["auto", "squares", "robust"] = "auto",
    skip: _Samples | Sequence[_Samples] = 0,
    validate: _HeldOut | Sequence[_HeldOut] | float | str | Sequence[_Samples] | None = None,
    progress: Callable[[float, float], object] | None = None,
    keep_partial: bool = False,
) -> Identification:
    """Fits a model to measured records.

    y = output_offset + G[creep[sum_i w_i z_i + s]], z_i the operators at u - input_offset, s the loop shift, G the linear dynamics
    and a dead time; y(k) is read at the moment at which u(k) is put out. Weights are non-negative least squares, exact at every
    step of a search over everything else. Every record starts from the virgin state, at rest at its first input, and has its
    own output offset.

    What is "auto" is left to cross-validation: stretches of the records are predicted from fits to the others, and the simplest
    model that predicts as well as the best stays.

    Parameters
    ----------
    u, y : arrays of n floats
        Input (V) and measured output (um). Or, for several records in one fit, a list of (u, y) pairs as the only
        argument.
    dt : float or list of float, optional
        Sampling interval in seconds, one for all records or one for each. Without it times are in samples, and only the
        hysteresis can be fitted.
    times : array or list of arrays, optional
        When every sample was taken, in seconds, for each record. They change no fit, and give no dt: a warning tells gaps and jitter.
        Times that do not increase are refused, and so are those whose usual step is more than a half of dt away from dt.
    model : "modified" or "conventional"
        Coupled plays, or plays for comparison.
    weights : "auto", "free", "quadratic" or "split"
        Any w_i >= 0; or w_0 >= 0 and w_i = c0 + c1 i + c2 i^2 >= 0; or weights of their own below zero, which only the
        modified model has. "auto" takes the first of quadratic, free and split that predicts held-out stretches of the
        records as well as the best, within the standard error of the ratio of their mean squares.
    operators : int or "auto", optional
        How many. With uniform thresholds r_i = i X / n; the first is the identity. Without a number there are as many as thresholds that
        are given; else 20, or 40 or 80 where each doubling predicts held-out stretches of the records better, by 2 % of the error at
        least and by more than its standard error. "auto" takes the fewest of 4 to 80 that predict them as well as any. Either is
        chosen with everything else in the model; every stretch is predicted from weights fitted to the others, all that is
        searched linearised about its values for all. A sample costs the same with any number of operators.
    ratios : "fit" or (ra, rb, rc)
        Thresholds as fractions of r.
    input_offset : "fit" or float
        In the unit of u. The conventional model fixes it at the middle of the input range.
    dead_time : "fit" or float
        What y lags u besides, in seconds; in samples where there is no dt.
    dynamics : "auto", None, 2 or 1
        Linear dynamics behind the hysteresis: of second order, or a first-order lag. They need dt and records that reach
        their frequency; a warning says if these do not tell those that were asked for. "auto" is 2, 1 or None: 1 in the
        place of an overdamped 2 that is not told from it, or where that predicts better beside a map.
    modes : "auto", 1, 2 or 3
        How many modes in parallel the second-order dynamics have: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1), the gains
        g_i sum to 1. "auto" begins with one, and adds a second and a third as far as the records tell them. A warning says if they
        tell fewer than were asked for.
    creep : "auto", None, "log", int or array
        Creep: log-type with one amplitude, so many terms a decade apart, or these time constants in seconds. "auto" is "log" or
        None.
    loop_shift : "auto", None or float
        How far the centre of a loop moves with its amplitude, of this time constant in seconds: see `plant.LoopShift`. It
        holds at the rates of the records only.
    amplifier : "auto", None or float
        The amplifier in front of the hysteresis, a first-order lag: of this bandwidth in Hz. "auto" fits one beside second-order
        dynamics if the records tell its lag from a dead time.
    input_map, output_map : "auto", None or "smooth"
        A rising map of the drive in front of the hysteresis, and of the position behind it, over the range of the records: the
        logarithm of its slope is a cubic, all of them straight pieces in the stage. "auto" fits the one that predicts held-out
        stretches better by a tenth of the error, and both if the other one gains a sixth more. Loops that only decay must
        say more for a map than for a loop shift: see the finding `map_not_told`.
    thresholds : "uniform", "quantiles", "geometric" or array, optional
        The r_i: evenly spaced, at quantiles of the amplitudes at which u turns round, growing by a constant factor, or given.
        "geometric" gives small loops more operators: r_i = X / q^(n - i), i >= 1, q = min(2, 100^(1 / (n - 1))): from X / 100 on.
    smoothness : float or "auto"
        Adds smoothness U D to the sum of squared errors: U the sum of squares of u about its mean, D that of the second
        differences w_(i-1) - 2 w_i + w_(i+1), i >= 1, of each family (of weights per threshold interval, divided, where
        thresholds are uneven). A number without unit: 1 weighs such a difference like an error of the slope w_0.
        "auto" takes of 0 and the decades 1e-6 to 100 the one that predicts held-out stretches best.
    loss : "auto", "squares" or "robust"
        What glitches of y do to the fit: single wrong samples, or runs of up to 25. "auto" leaves those out that lie more than seven
        standard deviations of the residual from the samples about them, and begin and end abruptly; a record without any gives the
        very fit of "squares", which counts all samples. "robust" does so from 4.5 standard deviations on, for records that are
        known to have glitches. `left_out_samples` of the result names them.
    skip : int or list of int
        Leading samples of each record that set the memory but are not fitted, or a time such as "2s".
    validate : (u, y), (u, y, skip), a list of these, float, int or list of int, optional
        Records that are held out, each judged with the output offset that suits it. Or a part at the end of every record
        that is held out, judged with the record's own offset: a share, or the sample or time ("2s") from which on, one for
        all records or a list of one for each.
    progress : callable, optional
        Called with (fraction done, best rms error so far). Ctrl-C stops either way.
    keep_partial : bool
        Whether Ctrl-C, or a KeyboardInterrupt that progress raises, ends the search with the best so far as the result,
        its `partial` True, instead of a KeyboardInterrupt.

    Returns
    -------
    Identification

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> actuator = mh.paper.table_1_recovered()
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1000)
    >>> found = mh.identify(u, actuator.forward().run(u), input_offset=0.0, dead_time=0.0)
    >>> [round(ratio, 4) for ratio in found.ratios]
    [0.95, 0.3, 0.35]
    """

@final
class ComparedModel:
    """One model of a comparison, with its errors on what it was fitted to and on stretches held out.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
    >>> compared = mh.compare(u, mh.paper.table_1_recovered().forward().run(u), operators=6)
    >>> [model.model for model in compared.rows]
    ['conventional', 'polynomial + plays', 'modified']
    """

    @property
    def model(self) -> str:
        """The name of the model, as `compare` lists them."""
    @property
    def weights_law(self) -> Literal["free", "quadratic", "split"]:
        """What its weights might be: as given, or as cross-validation chose."""
    @property
    def unknowns(self) -> int:
        """How many numbers were fitted: those of the weight law, of polynomial or loop shift, output offsets and creep under way of the
        records, and everything that was searched.
        """
    @property
    def kept(self) -> list[Literal["creep", "loop shift", "dynamics"]]:
        """The extensions in it: "creep", "loop shift", "dynamics", "maps". One that was "auto" is there if cross-validation kept it."""
    @property
    def fit(self) -> Quality:
        """The errors over the fitted samples of all records."""
    @property
    def held_out(self) -> float:
        """Root mean square error on the held-out stretches, in the unit of the output: the mean of the squares over the stretches."""
    @property
    def held_out_percent(self) -> float:
        """The same in % of `fit.range`, the peak-to-peak of the measured output."""
    @property
    def worst_stretch(self) -> float:
        """The largest of `stretches`."""
    @property
    def worst_stretch_percent(self) -> float:
        """The same in % of `fit.range`."""
    @property
    def stretches(self) -> list[float]:
        """Root mean square error on every held-out stretch, in the unit of the output. Stretch i is the i-th eighth of every record."""
    def residuals(self, u: ArrayLike, y: ArrayLike, *, record: int = 0) -> _Vector:
        """Measured minus modelled output of a record that was fitted, all its samples: (n,) in the unit of y.

        The model is that of all stretches, with the output offset of the record and the creep that was under way in it.

        Parameters
        ----------
        u, y : arrays of n floats
            Input and measured output, as they were given to `compare`.
        record : int
            The number of the record among those that were fitted.

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
        >>> y = mh.paper.table_1_recovered().forward().run(u)
        >>> row = mh.compare(u, y, operators=8).rows[0]
        >>> bool(abs((row.residuals(u, y) ** 2).mean() ** 0.5 - row.fit.rmse) < 1e-12)
        True
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class Comparison:
    """What `compare` found: a row for each model, the simplest first.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
    >>> compared = mh.compare(u, mh.paper.table_1_recovered().forward().run(u), operators=6)
    >>> compared.simplest
    'modified'
    """

    @property
    def rows(self) -> list[ComparedModel]:
        """One row for each model, the simplest first."""
    @property
    def simplest(self) -> str:
        """The name of the simplest model that predicts held-out stretches as well as the best one.

        As well: the factor between their mean square errors, over the stretches, is 1 within its standard error.
        """
    @property
    def omitted(self) -> dict[str, str]:
        """The extensions that were not tried, each with the reason."""
    @property
    def creep_under_way(self) -> bool:
        """Whether the models have the creep that was under way when a record began: in records whose start is skipped, if creep is not
        None. It is in all models alike, and no extension.
        """
    @property
    def left_out_samples(self) -> list[list[int]]:
        """The samples of each record that were taken for glitches and left out for all models, counted from 0 with the skipped ones."""
    def table(self, unit: str = "") -> str:
        """All of it as lines for a terminal; the errors in the unit of the output and in % of its peak-to-peak.

        `unit` is the name of that unit, for the header. A star marks the simplest model that predicts as well as the best.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def _repr_html_(self) -> str: ...

def compare(
    u: _Records,
    y: ArrayLike | None = None,
    *,
    dt: float | Sequence[float] | None = None,
    operators: int | Literal["auto"] | None = None,
    weights: Literal["auto", "free", "quadratic", "split"] = "auto",
    ratios: Literal["fit"] | tuple[float, float, float] = "fit",
    input_offset: Literal["fit"] | float = "fit",
    dead_time: Literal["fit"] | float = "fit",
    dynamics: Literal["auto", 1, 2] | None = "auto",
    modes: Literal["auto", 1, 2, 3] = "auto",
    creep: Literal["auto", "log"] | int | ArrayLike | None = "auto",
    loop_shift: Literal["auto"] | float | None = "auto",
    amplifier: Literal["auto"] | float | None = "auto",
    input_map: Literal["auto", "smooth"] | None = "auto",
    output_map: Literal["auto", "smooth"] | None = "auto",
    thresholds: Literal["uniform", "quantiles", "geometric"] | ArrayLike | None = None,
    smoothness: Literal["auto"] | float = "auto",
    loss: Literal["auto", "squares", "robust"] = "auto",
    skip: _Samples | Sequence[_Samples] = 0,
    progress: Callable[[float, float], object] | None = None,
) -> Comparison:
    """Fits several models to the same records and judges each on held-out stretches: what does each buy on these data?

    | model | y |
    | --- | --- |
    | conventional | sum_i w_i p_i[u], p_i plays |
    | polynomial + plays | a_2 x^2 + a_3 x^3 + sum_i w_i p_i[u], x the drive scaled to -1 to 1 |
    | modified | sum_i w_i z_i[u], z_i coupled plays |
    | modified + creep, + loop shift, + dynamics, + maps | the same with one extension |
    | modified + all | with all extensions, as `identify` fits them |

    Weights are not negative. p_0 and z_0 are the identity, so w_0 is the linear term of the polynomial. Polynomial + plays has no
    exact inverse here: it is for comparison only. Every model has a dead time, and every record an output offset; where creep is
    "auto", a record whose start is skipped also has the creep that was under way, in all models alike.

    The judge is the same for all. Every record is cut into eight stretches, and the i-th stretch of all records is predicted from a
    fit to the other stretches. Weights, offsets and polynomial are fitted anew exactly; ratios, input offset, dead time, dynamics
    and creep to first order about their values for all stretches. What "auto" stands for is chosen once, on all stretches, as in
    `identify`. All modified models have the weight law, the smoothness and the operators of the last of them, so that they differ
    by their extensions alone.

    Parameters
    ----------
    u, y : arrays of n floats
        Input (V) and measured output (um). Or, for several records, a list of (u, y) pairs as the only argument.
    dt : float or list of float, optional
        Sampling interval in seconds. Without it there are no extensions, and times are in samples.
    operators, weights, ratios, input_offset, dead_time, thresholds, smoothness, loss
        As in `identify`, for every model. Plays have no ratios; for split weights they have free ones. Glitches are those that
        the last model leaves.
    creep, loop_shift, dynamics, modes, amplifier, input_map, output_map
        As in `identify`, for the extensions. None leaves one out; modes and amplifier are those of the dynamics.
    skip : int or list of int
        Leading samples of each record that set the memory but are not fitted, or a time such as "2s".
    progress : callable, optional
        Called with (fraction done, best rms error so far). Ctrl-C stops either way.

    Returns
    -------
    Comparison
        One row for each model.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    >>> y = mh.paper.table_1_recovered().forward().run(u)  # coupled plays
    >>> found = mh.compare(u, y, operators=8)
    >>> ", ".join(row.model for row in found.rows)
    'conventional, polynomial + plays, modified'
    >>> found.simplest
    'modified'
    >>> conventional, polynomial, modified = found.rows
    >>> modified.held_out < 0.2 * min(conventional.held_out, polynomial.held_out)
    True
    >>> found.omitted.get("creep")
    'needs a sampling interval'
    """

@final
class Finding:
    """What makes records or a result doubtful: a code, a sentence, a number with the limit that it passed, and what to do.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
    >>> model = mh.paper.table_1_recovered()
    >>> found = mh.diagnose(u, -model.forward().run(u), model)  # a record that is wired the other way
    >>> found[0].code, found[0].severity
    ('wrong_sign', 'red')
    """

    @property
    def code(self) -> str:
        """Which finding: one of the names that docs/findings.md explains."""
    @property
    def severity(self) -> Literal["amber", "red"]:
        """ "amber": a number is doubtful, or another record would make the result better. "red": the result is not that of the
        stage.
        """
    @property
    def message(self) -> str:
        """One sentence with the numbers in it."""
    @property
    def value(self) -> float:
        """The number that was compared."""
    @property
    def limit(self) -> float:
        """What it was compared with."""
    @property
    def hint(self) -> str:
        """What to try next."""
    @property
    def record(self) -> int | None:
        """The record that shows it most, or None where there is one record only or all count together."""
    @property
    def sample(self) -> int | None:
        """The sample of that record where it is, or where it ends; skipped samples count. None where it is no place."""

def verdict(findings: Sequence[Finding]) -> Literal["green", "amber", "red"]:
    """The verdict on findings: that of the worst of them, or "green" if there is none.

    Parameters
    ----------
    findings : list of Finding
        Those of `diagnose`, or the warnings of an identification, whose `verdict` is the same.

    Returns
    -------
    "green", "amber" or "red"

    Raises
    ------
    TypeError
        For what is no list of findings.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> actuator = mh.paper.table_1_recovered()
    >>> u = mh.signals.sine(500.0, 1.0, seconds=5.0, rate=1000)
    >>> mh.results.verdict(mh.diagnose(u, actuator.forward().run(u), actuator))  # full strokes alone
    'amber'
    >>> mh.results.verdict([])
    'green'
    """

def diagnose(
    u: _Records,
    y: ArrayLike | None,
    model: _Model,
    *,
    skip: _Samples | Sequence[_Samples] = 0,
    dt: float | Sequence[float] | None = None,
    dead_time: float = 0.0,
    times: ArrayLike | Sequence[ArrayLike | None] | None = None,
) -> list[Finding]:
    """Looks for what records cannot tell and what a model left in them.

    Every finding has a code, a severity, a number, a limit and what to try next. docs/findings.md lists the codes.

    The residual is the measured minus the modelled output without its mean, over the fitted samples.

    Parameters
    ----------
    u, y : arrays of n floats
        Input (V) and measured output (um). Or, for several records, a list of (u, y) pairs and None.
    model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        Fitted to these records.
    skip : int or list of int
        Leading samples of each record that were not fitted.
    dt : float or list of float, optional
        Sampling interval in seconds, one for all records or one for each.
    dead_time : float
        What y lags u, in seconds; in samples where there is no dt.
    times : array or list of arrays, optional
        When every sample was taken, in seconds, for each record: increasing, and their usual step that of dt.

    Returns
    -------
    list of Finding
        Empty if nothing was found. `results.verdict` says how bad it is.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> actuator = mh.paper.table_1_recovered()
    >>> u = mh.signals.sine(500.0, 1.0, seconds=5.0, rate=1000)  # full strokes alone
    >>> for found in mh.diagnose(u, actuator.forward().run(u), actuator):
    ...     print(found.code, found.value, found.limit)
    no_minor_loops 0.0 2.0
    >>> made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000)
    >>> y = actuator.forward().run(made.drive)
    >>> mh.diagnose(made.drive, y, actuator, skip=made.initialization_samples)
    []
    """

def loop_width(u: ArrayLike, y: ArrayLike) -> float | None:
    """The widest distance between falling and rising outputs of full strokes at the same input.

    A full stroke leads from the lowest to the highest twentieth of the input range, or back. The outputs of all rising
    strokes are averaged in fifty parts of the range, those of the falling ones likewise, so noise averages out. Compare
    what was measured with what a model makes of the same input; a lag widens the loops of both.

    Parameters
    ----------
    u, y : arrays of n floats
        Input (V) and output (um).

    Returns
    -------
    float or None
        In the unit of y; None without a full stroke in both directions.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.triangle(500.0, 1.0, seconds=3.0, rate=1000)
    >>> round(mh.results.loop_width(u, mh.paper.table_1_recovered().forward().run(u)), 2)  # um
    0.49
    """

@final
class SecondOrder:
    """Second-order dynamics of unit static gain: y'' + 2 zeta w y' + w^2 y = w^2 u, w = 2 pi f.

    The mass-spring-damper that follows the hysteresis in Remark 1 of the paper.

    Parameters
    ----------
    frequency : float
        Undamped natural frequency f in Hz.
    damping : float
        Damping ratio zeta: below 1 the step response rings at f sqrt(1 - zeta^2).

    Raises
    ------
    ValueError
        Unless both are finite and above 0.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.plant.SecondOrder(2000.0, 0.03)
    >>> stage.response([1.0] * 4, dt=1e-4).round(3)
    array([0.   , 0.674, 1.733, 1.739])
    """

    def __new__(cls, frequency: float, damping: float) -> SecondOrder: ...
    @property
    def frequency(self) -> float:
        """Undamped natural frequency in Hz."""
    @property
    def damping(self) -> float:
        """Damping ratio."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.

        y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
        u[k] from y[k + 1] on.
        """
    def frequency_response(self, frequencies: ArrayLike) -> _Complex:
        """The complex gain at frequencies in Hz."""
    @property
    def poles(self) -> _Complex:
        """The poles in radians per second."""
    @property
    def zeros(self) -> _Complex:
        """The finite zeros in radians per second."""
    @property
    def static_gain(self) -> float:
        """The output that a constant input of 1 leads to."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class FirstOrder:
    """A first-order lag of unit static gain: tau y' + y = u, tau = 1 / (2 pi f).

    Parameters
    ----------
    frequency : float
        Cut-off frequency f in Hz, where a sine passes by 1/sqrt(2).

    Raises
    ------
    ValueError
        Unless it is finite and above 0.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> amplifier = mh.plant.FirstOrder(279.0)
    >>> amplifier.response([1.0, 1.0, 1.0], dt=1e-4).round(4)
    array([0.    , 0.1608, 0.2957])
    """

    def __new__(cls, frequency: float) -> FirstOrder: ...
    @staticmethod
    def from_time_constant(time_constant: float) -> FirstOrder:
        """A lag with the time constant tau in seconds.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> round(mh.plant.FirstOrder.from_time_constant(1e-3).frequency, 3)
        159.155
        """
    @property
    def frequency(self) -> float:
        """Cut-off frequency in Hz."""
    @property
    def time_constant(self) -> float:
        """tau in seconds."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.

        y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
        u[k] from y[k + 1] on.
        """
    def frequency_response(self, frequencies: ArrayLike) -> _Complex:
        """The complex gain at frequencies in Hz."""
    @property
    def poles(self) -> _Complex:
        """The poles in radians per second."""
    @property
    def zeros(self) -> _Complex:
        """The finite zeros in radians per second."""
    @property
    def static_gain(self) -> float:
        """The output that a constant input of 1 leads to."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Antiresonance:
    """An antiresonance and the resonance that belongs to it, of unit static gain.

    G(s) = ((s/w_a)^2 + 2 zeta_a s/w_a + 1) / ((s/w)^2 + 2 zeta s/w + 1): at the antiresonance a part of the structure takes up
    the force that would move the position.

    Parameters
    ----------
    zero, pole : SecondOrder
        Frequency and damping of the antiresonance, and of the resonance.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> pair = mh.plant.Antiresonance(mh.plant.SecondOrder(600.0, 0.01), mh.plant.SecondOrder(650.0, 0.01))
    >>> bool(abs(pair.frequency_response([600.0])[0]) < 0.2)
    True
    """

    def __new__(cls, zero: SecondOrder, pole: SecondOrder) -> Antiresonance: ...
    @property
    def zero(self) -> SecondOrder:
        """The antiresonance."""
    @property
    def pole(self) -> SecondOrder:
        """The resonance."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.

        y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
        u[k] from y[k + 1] on.
        """
    def frequency_response(self, frequencies: ArrayLike) -> _Complex:
        """The complex gain at frequencies in Hz."""
    @property
    def poles(self) -> _Complex:
        """The poles in radians per second."""
    @property
    def zeros(self) -> _Complex:
        """The finite zeros in radians per second."""
    @property
    def static_gain(self) -> float:
        """The output that a constant input of 1 leads to."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Modes:
    """Second-order modes in parallel: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1).

    The modal form of a mechanical structure. Where neighbours have gains of the same sign there is an antiresonance between
    them. Dynamics that follow each other are given in a list instead.

    Parameters
    ----------
    gains : array of n floats
        The share of each mode in the static gain; their sum must not be 0.
    modes : sequence of n SecondOrder

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> modes = mh.plant.Modes([0.8, 0.2], [mh.plant.SecondOrder(800.0, 0.02), mh.plant.SecondOrder(1500.0, 0.01)])
    >>> modes.static_gain, modes.zeros.size
    (1.0, 2)
    """

    def __new__(cls, gains: ArrayLike, modes: Iterable[SecondOrder]) -> Modes: ...
    @property
    def gains(self) -> _Vector:
        """The share of each mode in the static gain, read-only."""
    @property
    def modes(self) -> tuple[SecondOrder, ...]:
        """The resonances."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.

        y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
        u[k] from y[k + 1] on.
        """
    def frequency_response(self, frequencies: ArrayLike) -> _Complex:
        """The complex gain at frequencies in Hz."""
    @property
    def poles(self) -> _Complex:
        """The poles in radians per second."""
    @property
    def zeros(self) -> _Complex:
        """The finite zeros in radians per second."""
    @property
    def static_gain(self) -> float:
        """The output that a constant input of 1 leads to."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class StateSpace:
    """Stable linear dynamics of one input and one output in continuous time: x' = A x + b u, y = c x + d u.

    Time is in seconds. The static gain d - c A^-1 b is not 0.

    Parameters
    ----------
    a : array of shape (n, n)
    b, c : arrays of n floats
    d : float

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> lag = mh.plant.StateSpace([[-500.0]], [2.0], [250.0], 0.0)
    >>> same = mh.plant.StateSpace.from_transfer_function([1.0], [0.002, 1.0])
    >>> bool(abs(lag.frequency_response([80.0]) - same.frequency_response([80.0]))[0] < 1e-15)
    True
    """

    def __new__(cls, a: ArrayLike, b: ArrayLike, c: ArrayLike, d: float = 0.0) -> StateSpace: ...
    @staticmethod
    def from_transfer_function(numerator: ArrayLike, denominator: ArrayLike) -> StateSpace:
        """From the coefficients of numerator and denominator, the highest power of s (in radians per second) first."""
    @property
    def a(self) -> _Matrix:
        """A, in 1/s."""
    @property
    def b(self) -> _Vector:
        """b."""
    @property
    def c(self) -> _Vector:
        """c."""
    @property
    def d(self) -> float:
        """d: what passes at once."""
    def to_control(self) -> Any:
        """The same as a StateSpace of the package control, which must be installed."""
    def to_scipy(self) -> Any:
        """The same as a scipy.signal.StateSpace; scipy must be installed."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.

        y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
        u[k] from y[k + 1] on.
        """
    def frequency_response(self, frequencies: ArrayLike) -> _Complex:
        """The complex gain at frequencies in Hz."""
    @property
    def poles(self) -> _Complex:
        """The poles in radians per second."""
    @property
    def zeros(self) -> _Complex:
        """The finite zeros in radians per second."""
    @property
    def static_gain(self) -> float:
        """The output that a constant input of 1 leads to."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

_Lag: TypeAlias = SecondOrder | FirstOrder
_Section: TypeAlias = SecondOrder | FirstOrder | Antiresonance | Modes | StateSpace
_Dynamics: TypeAlias = _Section | Sequence[_Section]

@final
class Creep:
    """Log-type creep as a sum of first-order lags: y = x + sum_k c_k x_k, tau_k x_k' + x_k = x.

    After a step of x the output is there at once and then creeps on to (1 + sum_k c_k) x.

    Parameters
    ----------
    amplitudes : array of n floats
        c_k, as shares of x.
    time_constants : array of n floats
        tau_k in seconds, strictly increasing.

    Raises
    ------
    ValueError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> creep = mh.plant.Creep.logarithmic(0.02, start=0.01, end=1000.0, terms=10)
    >>> position = creep.response([1.0] * 1000, dt=0.01)
    >>> round(float(position[999] - position[99]), 4)  # from 1 s to 10 s after the step: 2 % per decade
    0.02
    """

    def __new__(cls, amplitudes: ArrayLike, time_constants: ArrayLike) -> Creep: ...
    @staticmethod
    def logarithmic(gamma: float, start: float, end: float, terms: int) -> Creep:
        """The usual law of creep after a step to x: y(t) = x (1 + gamma log10(t / start)), from `start` to `end`.

        Parameters
        ----------
        gamma : float
            The share by which the position grows per decade: 0.01 to 0.02 for stacks of PZT.
        start, end : float
            Seconds after the step: where the law begins (y = x there) and where creep ends.
        terms : int
            How many lags: two per decade keep the ripple below 1e-3 gamma.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> mh.plant.Creep.logarithmic(0.01, start=0.1, end=10.0, terms=2).amplitudes
        array([0.01, 0.01])
        """
    @property
    def amplitudes(self) -> _Vector:
        """c_k, read-only."""
    @property
    def time_constants(self) -> _Vector:
        """tau_k in seconds, read-only."""
    def response(self, u: ArrayLike, dt: float) -> _Vector:
        """The response to `u` from rest at zero, each input held for `dt` seconds: y[k] is the output at the moment at which
        u[k] is put out.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class LoopShift:
    """The shift of a loop: what motion of the drive u adds to the position.

    Measured on piezo stacks: the centre of a loop moves with its amplitude, or rate. No model of Preisach's class has that.
    Behind the output map, in front of the creep, the position gains s = c_1 m + c_2 n:

    x = (u - center) / half_range;
    e = x - f, within -limit .. limit, where f follows x with the time constant tau / 4;
    m' = (e^2 - m) / tau, n' = (x abs(e) - n) / tau.

    For a motion that is slow beside tau, e is about (tau / 4) x'. c_1 moves the centre of every loop, c_2 that of a loop
    that lies off the centre of the range. At rest s is 0. It follows from past drives alone, so the inverse of the stage
    stays exact, sample by sample. A shift says nothing of other rates than those of its records: `limit`, the largest e
    there, keeps it from growing hundredfold at ten times the rate.

    Parameters
    ----------
    center : float
        The drive in the middle of the range.
    half_range : float
        Half of the range of drives.
    amplitudes : (float, float)
        c_1 and c_2, in the unit of the position.
    time_constant : float
        tau in seconds.
    limit : float
        The largest magnitude of e, without a unit.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> shift = mh.plant.LoopShift(0.0, 500.0, amplitudes=(-0.6, 0.0), time_constant=0.2, limit=0.5)
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), loop_shift=shift)
    >>> drive = mh.signals.sine(400.0, 1.0, seconds=4.0, rate=1e3)  # V
    >>> moved = stage.forward(1e-3).run(drive) - stage.replace(loop_shift=None).forward(1e-3).run(drive)
    >>> round(float(moved[-1000:].mean()), 4)  # um
    -0.0172
    """

    def __new__(
        cls,
        center: float,
        half_range: float,
        amplitudes: Sequence[float],
        time_constant: float,
        limit: float,
    ) -> LoopShift: ...
    @property
    def center(self) -> float:
        """The drive in the middle of the range."""
    @property
    def half_range(self) -> float:
        """Half of the range of drives."""
    @property
    def amplitudes(self) -> tuple[float, float]:
        """c_1 and c_2, in the unit of the position."""
    @property
    def time_constant(self) -> float:
        """tau in seconds."""
    @property
    def limit(self) -> float:
        """The largest magnitude of e."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

_Map: TypeAlias = tuple[ArrayLike, ArrayLike]
_Points: TypeAlias = tuple[list[float], list[float]]

@final
class Stage:
    """A whole stage: limits, dead time, amplifier, hysteresis, loop shift, creep, modes and sensor noise in one
    object.

    limits -> dead time -> amplifier -> input map -> hysteresis -> output map -> loop shift -> creep -> modes -> sensor

    Made by `identify(...).stage`, by `load(path)`, or from its parts. Immutable. Everything that runs is made from it, so
    parameters, limits and times are stated once. Times are in seconds, frequencies in Hz.

    Parameters
    ----------
    hysteresis : ModifiedPrandtlIshlinskii or PrandtlIshlinskii
    limits : (float, float), optional
        The drive never leaves (low, high), in the unit of the drive.
    slew : float, optional
        How fast the drive may change, per second.
    dead_time : float
        What the sensor shows later than hysteresis and modes explain, in seconds, for a drive that is put out at t_k and held,
        and a position that is read at t_k.
    amplifier_bandwidth : float, optional
        Cut-off frequency in Hz of a first-order amplifier in front of the hysteresis.
    dynamics : FirstOrder, SecondOrder, Modes, StateSpace, a sequence of them in series, or an object of control or scipy
        The modes and lags behind the hysteresis; their static gain may differ from 1.
    creep : Creep, optional
    loop_shift : LoopShift, optional
        What motion of the drive adds behind the output map, in front of the creep.
    input_map, output_map : (array, array), optional
        The points (x, y) of a strictly monotone piecewise-linear map in front of the hysteresis, and of one behind it.
    noise : float, optional
        Rms noise of the sensor, in the unit of the position.
    units : (str, str)
        Names of the units of drive and position.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(
    ...     mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dead_time=1e-4,
    ...     dynamics=mh.plant.SecondOrder(800.0, 0.02), creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8))
    >>> target = mh.signals.sine(2.5, 10.0, seconds=0.3, rate=10e3)
    >>> drive = stage.precompensate(target, dt=1e-4)
    >>> error = stage.forward(dt=1e-4).run(drive) - target
    >>> bool(abs(error[1000:]).max() < 1e-3)  # um
    True
    """

    def __new__(
        cls,
        hysteresis: _Model,
        *,
        limits: Sequence[float] | None = None,
        slew: float | None = None,
        dead_time: float = 0.0,
        amplifier_bandwidth: float | None = None,
        dynamics: _Dynamics | Any | None = None,
        creep: Creep | None = None,
        loop_shift: LoopShift | None = None,
        input_map: _Map | None = None,
        output_map: _Map | None = None,
        noise: float | None = None,
        units: tuple[str, str] = ("V", "um"),
    ) -> Stage: ...
    @property
    def hysteresis(self) -> ModifiedPrandtlIshlinskii:
        """The hysteresis."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits of the drive (low, high), or None."""
    @property
    def slew(self) -> float | None:
        """How fast the drive may change, per second, or None."""
    @property
    def dead_time(self) -> float:
        """What the sensor shows later than hysteresis and modes explain, in seconds."""
    @property
    def amplifier_bandwidth(self) -> float | None:
        """Cut-off frequency of the amplifier in Hz, or None."""
    @property
    def dynamics(self) -> Any:
        """The modes and lags behind the hysteresis: FirstOrder, SecondOrder, Modes, StateSpace, a tuple of them in series, or None."""
    @property
    def creep(self) -> Creep | None:
        """The creep, or None."""
    @property
    def loop_shift(self) -> LoopShift | None:
        """The loop shift, or None."""
    @property
    def input_map(self) -> _Points | None:
        """The points (x, y) of the map in front of the hysteresis, or None."""
    @property
    def output_map(self) -> _Points | None:
        """The points (x, y) of the map behind the hysteresis, or None."""
    @property
    def noise(self) -> float | None:
        """Rms noise of the sensor, in the unit of the position, or None."""
    @property
    def units(self) -> tuple[str, str]:
        """The units of drive and position."""
    @property
    def identified(self) -> dict[str, Any] | None:
        """What identification knows of the stage, as a dictionary: ranges, sampling intervals, errors, covariance, warnings,
        names and SHA-256 of the records. None for a stage that was made from its parts.
        """
    @property
    def drive_range(self) -> tuple[float, float] | None:
        """Between which drives what runs stays by default: the limits within the range that was identified."""
    @property
    def is_narrowed(self) -> bool:
        """Whether `drive_range` is what was identified, as the limits reach beyond it or there are none. What a converter rounds does not
        count.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> drive = mh.signals.decaying_triangle(100.0, 1.0, cycles=5, rate=1000)  # V
        >>> position = mh.paper.table_1().forward().run(drive)  # um
        >>> found = mh.identify(drive, position, operators=10)
        >>> wide = found.stage.replace(limits=(-500.0, 500.0))
        >>> wide.drive_range, wide.is_narrowed
        ((-100.0, 100.0), True)
        >>> wide.replace(limits=(-80.0, 80.0)).is_narrowed
        False
        """
    @property
    def position_range(self) -> tuple[float, float] | None:
        """The positions that the stage reaches whatever happened before, or None without a range of drives.

        Every position in it has a drive within `drive_range`, after any history within it: these are the ends of the slow
        loop over that range. So what remains at its low end after a full stroke is outside, though a stage that was never
        driven begins there. Creep counts where it is worst, at rest at the other end, but takes no more than a quarter of
        the loop from either end. What modes overshoot and what a loop shift adds in motion do not count: a fast reference
        reaches less. What the records held is in `identified`.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> stage = mh.Stage(mh.PrandtlIshlinskii([0.5, 0.5], [0.0, 10.0]), limits=(0.0, 100.0))
        >>> stage.position_range  # at first 0, but 5 after any stroke of 20 or more
        (5.0, 95.0)
        """
    @property
    def slope_range(self) -> tuple[float, float]:
        """The lowest and the highest slope of the position over the drive."""
    def forward(self, dt: float) -> StageForward:
        """The whole chain, sample by sample, at rest."""
    def inverse(self, dt: float, limits: Sequence[float] | None = None) -> StageInverse:
        """The exact inverse of maps, hysteresis, loop shift and creep, sample by sample, at rest; `limits` must lie within the
        stage's, by default `drive_range`.
        """
    def bracket(self, limits: Sequence[float] | None = None) -> Bracket:
        """How uncertain the position is when the history between the limits is unknown, without loop shift, creep and
        dynamics.
        """
    def precompensate(
        self,
        reference: ArrayLike | _Trajectory,
        dt: float,
        *,
        limits: Sequence[float] | None = None,
        start: float | None = None,
        history: ArrayLike | None = None,
        lead_in: float | None = None,
    ) -> _Vector:
        """The drives that move the stage along a reference: the position that is read at t_k is reference[k].

        The reference is led through the inverse of amplifier, modes and dead time, then sample by sample through the exact
        inverse of creep, loop shift, maps and hysteresis. The stage begins at rest at the drive `start`, or where
        `history` has left it.

        Parameters
        ----------
        reference : array of n floats, or one of `trajectories`
        dt : float
            Sampling interval in seconds.
        limits : (float, float), optional
            Within those of the stage; by default `drive_range`.
        start : float, optional
            The drive at which the stage has rested, virgin but for the way there; by default 0, or the limit nearest to it.
        history : array of floats, optional
            The drives since that rest, oldest first, one per sampling interval: what hysteresis, loop shift and creep
            remember. After a full stroke these are its two ends and the drive of now, as in `history=[0.0, 150.0, 0.0]`.
        lead_in : float, optional
            Seconds of a smooth way from there to the beginning of the reference, in front of the result. Without it the
            reference must begin where the stage is.

        Returns
        -------
        array of n floats, or more by the samples of the lead-in

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came.

        Warns
        -----
        UserWarning
            If limits or slew rate held drives back.
        """
    def tune(
        self,
        dt: float,
        peak_sensitivity: float = 1.7,
        *,
        frequency_uncertainty: float | None = None,
        damping_uncertainty: float | None = None,
        structure: _Structure | None = None,
    ) -> Tuning:
        """Filters and gains of the feedback for every slope of the hysteresis: as `control.tune`.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
        >>> tuning = stage.tune(1e-4, structure="active damping")
        >>> tuning.kp < 0.0, tuning.explanation.split(".")[0]
        (True, 'A low-pass and a negative proportional gain damp the resonance actively')
        """
    def preview(
        self,
        dt: float,
        ahead: int | None = None,
        *,
        window: int | None = None,
        degree: int | None = None,
    ) -> Preview:
        """The window of references that leads through the inverse of amplifier, modes and dead time: as `control.preview`."""
    def controller(
        self,
        dt: float,
        limits: Sequence[float] | None = None,
        feedforward: Literal["inverse", "preview", "given"] = "inverse",
        *,
        kp: float | None = None,
        ki: float | None = None,
        ahead: int | None = None,
        smoothing: float | Literal["modes"] | None = None,
        drift: float | None = None,
        period: int | None = None,
        frequency_uncertainty: float | None = None,
        damping_uncertainty: float | None = None,
    ) -> HybridController:
        """A controller of this stage: tuned gains, its limits and slew rate, and a gate for measurements that cannot be. Dead time, creep
        and modes are in its feed-forward, an observer and learning in its loop, each where it is asked for.

        Parameters
        ----------
        dt : float
            Sampling interval in seconds.
        limits : (low, high), optional
            Within those of the stage; by default `drive_range`.
        feedforward : "inverse", "preview" or "given"
            The exact inverse of the reference of now; of a target made of references that come `preview.ahead` samples early,
            through the inverse of amplifier, modes and dead time too; or drives that come with every sample.
        kp, ki : float, optional
            Gains in V/um and V/um/s instead of tuned ones, both or none.
        ahead : int, optional
            How many samples early references come, for "preview"; by default as many as
            the dynamics need: 4 more than the dead time, and more for zeros in the right half plane.
        smoothing : float or "modes", optional
            References with steps and corners, for "preview": they are smoothed over so many seconds, and come half of that
            earlier. "modes" is three periods of the slowest lightly damped mode, which then stays at rest.
        drift : float, optional
            Puts an `Observer` of this stage before the feedback: by how much what the model does not know changes in one second, um.
        period : int, optional
            Learns a reference that repeats after so many samples, by `RepetitiveControl`. Learning that diverges stops and fades out:
            `divergence_count` and `learning_phase` of the controller tell.
        frequency_uncertainty, damping_uncertainty : float, optional
            Beside `period`: how far lightly damped modes may be from what is known, as a share of their frequency and a factor of their
            damping. Tuned gains and learning suit all of these. By default 0.05 and 2, or three standard errors of the identification where
            they are more.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dynamics=mh.plant.SecondOrder(400.0, 0.95))
        >>> controller, plant = stage.controller(dt=1e-4), stage.plant(dt=1e-4)
        >>> for reference in mh.signals.sine(2.0, 10.0, seconds=0.2, rate=10e3):
        ...     drive = controller.step(reference, plant.measured)
        ...     _ = plant.step(drive)
        >>> abs(controller.terms.error) < 0.05
        True
        >>> light = stage.replace(dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
        >>> controller = light.controller(1e-4, feedforward="preview", smoothing="modes")
        >>> step = [0.0] * 100 + [1.0] * 100  # um
        >>> run = mh.plant.simulate(controller, light.plant(dt=1e-4), step)
        >>> bool(max(run.position) < 1.005), bool(max(abs(run.position[130:] - 1.0)) < 1e-3)
        (True, True)
        >>> whole = light.replace(noise=0.002).controller(1e-4, feedforward="preview", drift=0.5, period=500)
        >>> wave = mh.signals.sine(1.0, 20.0, seconds=0.5, rate=10e3)  # ten periods
        >>> worn = light.replace(dynamics=mh.plant.SecondOrder(780.0, 0.03)).plant(1e-4)
        >>> run = mh.plant.simulate(whole, worn, wave)
        >>> worst = abs(run.position - wave).reshape(10, 500).max(axis=1)
        >>> bool(worst[0] > 2e-3), bool(worst[8] < 1e-4)  # um, in the first and the ninth period
        (True, True)
        >>> changed = light.replace(dynamics=mh.plant.SecondOrder(620.0, 0.02)).plant(1e-4)  # a heavier load
        >>> run = mh.plant.simulate(whole, changed, mh.signals.sine(1.0, 20.0, seconds=1.5, rate=10e3))
        >>> whole.divergence_count, whole.learning_phase
        (1, 'stopped')
        """
    def observer(self, dt: float, *, drift: float, noise: float | None = None) -> Observer:
        """An observer of this stage: as `control.Observer`."""
    def iterative_learning(
        self,
        target: ArrayLike,
        dt: float,
        *,
        bandwidth: float | None = None,
        kp: float | None = None,
        ki: float | None = None,
        min_gain: float = 0.15,
        target_limits: Sequence[float] | None = None,
        noise: float | None = None,
        frequency_uncertainty: float | None = None,
        damping_uncertainty: float | None = None,
        settle: int | None = None,
        on_demand: bool = False,
    ) -> IterativeLearning:
        """Learning from period to period around this stage: as `control.IterativeLearning`, tuned gains unless given. The slope may be
        any of the hysteresis.
        """
    def repetitive_control(
        self,
        period: int,
        dt: float,
        *,
        bandwidth: float | None = None,
        kp: float | None = None,
        ki: float | None = None,
        gain: float = 0.3,
        settle: int = 1,
        limit: float | None = None,
        frequency_uncertainty: float | None = None,
        damping_uncertainty: float | None = None,
    ) -> RepetitiveControl:
        """Learning in the running loop around this stage: as `control.RepetitiveControl`, tuned gains unless given. The slope may be any of
        the hysteresis.
        """
    def plant(
        self,
        dt: float,
        seed: int = 0,
        *,
        dac_bits: int | None = None,
        adc_bits: int | None = None,
        adc_range: Sequence[float] | None = None,
    ) -> Plant:
        """This stage between converters, with the noise of its sensor: as `plant.Plant`."""
    def simulate(
        self,
        reference: ArrayLike | _Trajectory,
        dt: float,
        *,
        limits: Sequence[float] | None = None,
        feedforward: Literal["inverse", "preview"] = "preview",
        kp: float | None = None,
        ki: float | None = None,
        seed: int = 0,
        period: float | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Run:
        """Lets this stage follow a reference under its own controller: `plant(dt, seed)` and `controller(dt, limits, feedforward)`.

        `period` of the reference in samples makes `settled` of the run leave out the first.
        """
    def to_control(self) -> Any:
        """The linear part (amplifier, modes) as a `control.StateSpace` of the package control; its dead time is not part of it."""
    def to_scipy(self) -> Any:
        """The linear part (amplifier, modes) as a `scipy.signal.StateSpace`; its dead time is not part of it."""
    def to_bytes(self) -> bytes:
        """The stage as bytes, which `from_bytes` and the C library read: smaller than its file. Every number is there bit for bit.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> stage = mh.Stage(mh.paper.table_1(), limits=(-500.0, 500.0))
        >>> mh.Stage.from_bytes(stage.to_bytes()) == stage
        True
        """
    @classmethod
    def from_bytes(cls, bytes: bytes) -> Stage:
        """The stage that `to_bytes` wrote.

        Raises ValueError for bytes that are cut off, changed, longer, of something else or of another release.
        """
    def save(self, path: str | PathLike[str]) -> None:
        """Writes the stage to a JSON file; the file appears only when it is complete."""
    def replace(self, **changes: Any) -> Stage:
        """A copy with other arguments of the constructor; of what was identified it keeps what still holds.

        The lag of amplifier, dynamics and dead time together was identified: parts that change it raise a ValueError, as the
        dead time holds the lag of all that was not fitted. Another hysteresis or map drops all that was identified,
        another loop shift or other linear parts its errors and warnings.
        """
    def with_records(self, records: Sequence[tuple[str, str | None]]) -> Stage:
        """A copy that says from which records it was identified: a list of (name, SHA-256 or None)."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def plot(
        self,
        u: ArrayLike | None = None,
        y: ArrayLike | None = None,
        *,
        record: int | None = None,
        skip: int = 0,
        dt: float | None = None,
        units: _Units = None,
        axes: Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw it with `mpi_hyst.plot.loops`, which has the arguments."""
    def _repr_html_(self) -> str: ...

@final
class StageForward:
    """The position of a stage, sample by sample: made by `stage.forward(dt)`.

    `step(u)` returns the row y(k) of a record: the position at the moment at which the drive u(k) is put out. `advance(u)`
    returns the position one interval later, just before the next drive: what a controller reads next.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), dead_time=1e-4)
    >>> forward = stage.forward(dt=1e-4)
    >>> forward.run([100.0, 100.0, 100.0, 100.0]).round(3)  # one sample of dead time, one that the mode needs
    array([0.   , 0.   , 0.013, 0.044])
    """

    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def advance(self, drive: float) -> float:
        """Holds a drive for one sampling interval and returns the position at its end, just before the next drive."""
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first, one per sampling interval."""
    def settle(self, drive: float) -> float:
        """At rest since forever at a drive: creep and modes at their ends, the hysteresis virgin but for the way there.
        Returns the position.
        """
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    @property
    def clamped(self) -> int:
        """How many drives lay beyond the limits of the stage and were clamped."""
    @property
    def position(self) -> float:
        """The last position."""
    def state_bytes(self) -> bytes:
        """What `state` says, as bytes: `state` takes them too."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any] | bytes) -> None: ...
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""

@final
class StageInverse:
    """The exact inverse of a stage without its fast dynamics, sample by sample: made by `stage.inverse(dt)`.

    It inverts input map, hysteresis, output map, loop shift and creep. The drive never leaves the limits; a target out of
    reach puts it at a limit and sets `saturated`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), creep=creep, limits=(-500.0, 500.0))
    >>> forward, inverse = stage.forward(dt=1e-4), stage.inverse(dt=1e-4)
    >>> target = mh.signals.sine(2.5, 10.0, seconds=0.2, rate=10e3)
    >>> bool(abs(forward.run(inverse.run(target)) - target).max() < 1e-13)
    True
    """

    def step(self, sample: float, /) -> float:
        """Takes one sample and returns the output. A sample that is not finite leaves everything as it is."""
    def peek(self, sample: float, /) -> float:
        """What `step` would return, without taking the sample."""
    def run(self, input: ArrayLike, out: _Vector | None = None) -> _Vector:
        """Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array."""
    def set_model(self, model: _Model) -> None:
        """Goes on with another model of the same thresholds and input offset as the hysteresis, without a jump of the drive.

        Raises ValueError that names what differs; the stream is as before then.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first, one per sampling interval."""
    def settle(self, drive: float) -> float:
        """At rest since forever at a drive: creep and modes at their ends, the hysteresis virgin but for the way there.
        Returns the position.
        """
    def reset(self) -> None:
        """Back to the start: at rest, or at the initial outputs that were given."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    @property
    def drive(self) -> float:
        """The last drive."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits of the drive (low, high), or None."""
    @property
    def memory(self) -> _Vector:
        """The reversals of the input of the hysteresis that still determine its output, oldest first."""
    @property
    def saturated(self) -> bool:
        """Whether the last target was out of reach and the drive is at a limit."""
    def state_bytes(self) -> bytes:
        """What `state` says, as bytes: `state` takes them too."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any] | bytes) -> None: ...
    @property
    def rejected(self) -> int:
        """How many samples were not finite, or beyond 1e100."""
    def plot(self, *, units: _Units = None, axes: Sequence[Axes] | None = None) -> Figure:
        """Draw it with `mpi_hyst.plot.memory`, which has the arguments."""

@final
class Bracket:
    """How uncertain the output is when its history is unknown: made by `model.bracket(limits)` or
    `stage.bracket()`.

    Two streams bracket the truth: one that came down from the upper limit, one that came up from the lower. The width
    shrinks as the motion wipes history out; after a full stroke it is zero. All weights must be 0 or more. Maps of a stage
    are part of it, its loop shift, creep and dynamics are not.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> bracket = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]).bracket(limits=(-10.0, 10.0))
    >>> bracket.step(3.0), bracket.width
    ((3.5, 5.5), 2.0)
    >>> bracket.step(10.0), bracket.width  # a full stroke
    ((14.0, 14.0), 0.0)
    """

    def step(self, drive: float) -> tuple[float, float]:
        """Takes a drive; the lowest and the highest output that there can be."""
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first."""
    @property
    def outputs(self) -> tuple[float, float]:
        """The lowest and the highest output that there can be now."""
    @property
    def width(self) -> float:
        """The highest minus the lowest output."""
    @property
    def limits(self) -> tuple[float, float]:
        """The limits (low, high) between which the unknown history lies."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    def reset(self) -> None:
        """Nothing is known of the history."""

@final
class BracketArray:
    """How uncertain the outputs of many actuators are when their history is unknown: made by `array.bracket(limits)`.

    For each actuator what `Bracket` is for one, bit for bit. All weights must be 0 or more.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 2)
    >>> bracket = mirror.bracket(limits=(-10.0, 10.0))
    >>> low, high = bracket.step([3.0, 10.0])
    >>> low, high
    (array([ 3.5, 14. ]), array([ 5.5, 14. ]))
    >>> bracket.width  # the second one has made a full stroke
    array([2., 0.])
    """

    def step(self, drive: ArrayLike) -> tuple[_Vector, _Vector]:
        """Takes one drive for each actuator, an array of shape (M,); the lowest and the highest outputs that there can be."""
    def run(self, drives: ArrayLike) -> tuple[_Matrix, _Matrix]:
        """Takes rows of drives, an array of shape (samples, M), bit for bit like `step` in a loop."""
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, an array of shape (samples, M), oldest drives first."""
    @property
    def outputs(self) -> tuple[_Vector, _Vector]:
        """The lowest and the highest outputs that there can be now."""
    @property
    def width(self) -> _Vector:
        """The highest minus the lowest output of each actuator."""
    @property
    def limits(self) -> _Matrix:
        """The limits (low, high) between which the unknown histories lie, an array of shape (M, 2)."""
    @property
    def state(self) -> list[dict[str, Any]]:
        """Everything that is remembered, as a list of M dictionaries to keep; set it to continue from there bit for bit."""
    @state.setter
    def state(self, state: list[dict[str, Any]]) -> None: ...
    def reset(self) -> None:
        """Nothing is known of any history."""
    def __len__(self) -> int: ...

@final
class DynamicsIdentification:
    """What `identify_dynamics` found: the linear part behind a hysteresis model, and how far to trust it.

    Standard deviations allow for coloured noise and for lags that are not in the model (docs/standard_errors.md); `warnings`
    tells what makes the numbers doubtful, by these codes:

    - "resonance_not_excited": the standard deviation of the frequency exceeds 5 %, the search ended at the edge of its
      domain, or a plain dead time fits as well up to what noise may pretend: the record does not tell the dynamics, and
      `dynamics` is None or critically damped then. Drive with a chirp or step that reaches the resonance.
    - "damping_undetermined": the same, of the damping, at 25 %.
    - "dead_time_confounded": the record tells the sum of dead time and lag of the dynamics alone: the standard deviation
      of the dead time exceeds a quarter of a sample.
    - "negative_dead_time": the output leads the drive by more than half a sample: a row holds a position that was read
      later.
    - "creep_undetermined": the standard deviation of the creep exceeds half of it.
    - "gain_not_one": the gain differs from 1 by more than 5 %: the hysteresis model is not that of this record.
    - "residual_coloured": what is left is correlated in time: the noise is coloured, or something is not modelled. The
      standard deviations allow for it.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> model = mh.paper.table_1_recovered()
    >>> u = np.where(np.arange(500) < 10, 0.0, 400.0)  # V, a step
    >>> y = mh.plant.SecondOrder(800.0, 0.05).response(model.forward().run(u), dt=1e-4)  # um
    >>> found = mh.identify_dynamics(u, y, model, dt=1e-4)
    >>> found.verdict, round(found.dynamics.frequency)
    ('green', 800)
    """

    @property
    def model(self) -> _Model:
        """The hysteresis model that was given."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    @property
    def dynamics(self) -> _Lag | None:
        """The SecondOrder or FirstOrder that was fitted, of unit static gain."""
    @property
    def dead_time(self) -> float:
        """What the output lags the input besides, in seconds."""
    @property
    def lag(self) -> float:
        """How much later slow motion is seen: dead time and lag of the dynamics together, in seconds. Without dynamics the dead
        time makes up for the held input, too: half a sampling interval.
        """
    @property
    def creep(self) -> Creep | None:
        """The Creep, or None if none was asked for."""
    @property
    def gain(self) -> float:
        """What multiplies the model's output: 1 if the model is right."""
    @property
    def output_offset(self) -> float:
        """What is added to gain times the model's output, in the unit of the output."""
    @property
    def frequency_std(self) -> float:
        """Standard error of the frequency in Hz."""
    @property
    def damping_std(self) -> float:
        """Standard error of the damping ratio; 0 for a first-order lag."""
    @property
    def dead_time_std(self) -> float:
        """Standard error of the dead time in seconds; 0 if it was given."""
    @property
    def lag_std(self) -> float:
        """Standard error of the lag in seconds."""
    @property
    def creep_std(self) -> _Vector:
        """Standard errors of the searched amplitudes of creep."""
    @property
    def parameters(self) -> list[str]:
        """The names of what was estimated, in the order of `covariance`: the gain first."""
    @property
    def covariance(self) -> _Matrix:
        """The covariance of `parameters`: what was given or lies at a bound is left out."""
    @property
    def noise(self) -> float:
        """Standard deviation of the measurement noise, estimated from the residuals, in the unit of the output."""
    @property
    def verdict(self) -> Literal["green", "amber", "red"]:
        """Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`."""
    @property
    def warnings(self) -> list[Finding]:
        """What makes the numbers doubtful; empty if nothing does."""
    @property
    def fit(self) -> Quality:
        """The errors over the fitted samples."""
    @property
    def evaluations(self) -> int:
        """How many passes over the record the search took."""
    def predict(self, u: ArrayLike) -> _Vector:
        """The output for the input `u` of the whole cascade, from the virgin state and at rest at its first value."""
    def _repr_html_(self) -> str: ...

@final
class ManyIdentifications:
    """Identified actuators: made by `identify_many`.

    `found[i]` is the model of actuator i. Arrays have a row or a number for each of M actuators; those of an actuator that could
    not be fitted are NaN, and `errors` says why. It is small: some numbers for each operator of each actuator.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> found = mh.identify_many(u, np.column_stack([y, 1.2 * y]), dt=0.01, weights="quadratic", smoothness=0.0)
    >>> found.verdicts, len(found), found[1].operators
    (['green', 'green'], 2, 20)
    """

    @property
    def weights(self) -> _Matrix:
        """The weights w_i, an array of shape (M, n); of split models those above zero."""
    @property
    def weights_negative(self) -> _Matrix:
        """The weights v_i below zero, an array of shape (M, n): those of `weights` unless the models are split."""
    @property
    def thresholds(self) -> _Matrix:
        """The thresholds r_i, an array of shape (M, n), in the unit of the input. They move with the input offset."""
    @property
    def ratios(self) -> _Matrix:
        """ra/r, rb/r and rc/r, an array of shape (M, 3)."""
    @property
    def input_offsets(self) -> _Vector:
        """The input offsets, in the unit of the input."""
    @property
    def output_offsets(self) -> _Vector:
        """The output offsets, in the unit of the output."""
    @property
    def dead_times(self) -> _Vector:
        """What each position lags its drive, in seconds; in samples where no dt was given."""
    @property
    def rmse(self) -> _Vector:
        """Root mean square errors over the fitted samples, in the unit of the output."""
    @property
    def nrmse(self) -> _Vector:
        """`rmse` over the peak-to-peak of each measured position."""
    @property
    def max_errors(self) -> _Vector:
        """Largest absolute errors, in the unit of the output."""
    @property
    def noise(self) -> _Vector:
        """Standard deviations of the noise, from the residuals, in the unit of the output."""
    @property
    def verdicts(self) -> list[Literal["green", "amber", "red"]]:
        """Whether each result deserves trust: "green", "amber" or "red", the worst of its findings; "red" for one that could not be
        fitted.
        """
    @property
    def findings(self) -> list[list[tuple[str, Literal["amber", "red"], float]]]:
        """What makes records or results doubtful: for each actuator a list of (code, severity, value). docs/findings.md explains the
        codes; `mpi_hyst.diagnose` of one actuator says more.
        """
    @property
    def errors(self) -> dict[int, str]:
        """The actuators that could not be fitted, each with the reason."""
    @property
    def weights_law(self) -> Literal["free", "quadratic", "split"]:
        """What the weights may be: as given, or as cross-validation chose for all actuators."""
    @property
    def smoothness(self) -> float:
        """How smooth the weights were asked to be: as given, or as cross-validation chose for all actuators."""
    @property
    def operators(self) -> int:
        """How many operators each model has."""
    @property
    def dt(self) -> float | None:
        """The sampling interval in seconds, or None."""
    def models(self) -> list[_Model | None]:
        """The model of each actuator; None for one that could not be fitted."""
    def actuator_array(self, missing: _Model | None = None) -> ActuatorArray:
        """The models as one array of actuators, which runs forward or inverse.

        `missing` is a model that takes the place of those that could not be fitted. Without one, these raise ValueError that names the
        first. Red fits are taken as they are, and a UserWarning names them.
        """
    def __getitem__(self, actuator: int, /) -> _Model: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def _repr_html_(self) -> str: ...

def identify_many(
    u: ArrayLike,
    Y: ArrayLike,  # noqa: N803
    *,
    dt: float | None = None,
    model: Literal["modified", "conventional"] = "modified",
    operators: int | Literal["auto"] | None = 20,
    weights: Literal["auto", "free", "quadratic", "split"] = "auto",
    ratios: Literal["fit"] | tuple[float, float, float] = "fit",
    input_offset: Literal["fit"] | float = "fit",
    dead_time: Literal["fit"] | float = "fit",
    thresholds: Literal["uniform", "quantiles", "geometric"] | ArrayLike | None = None,
    smoothness: Literal["auto"] | float = "auto",
    skip: _Samples = 0,
    threads: int = 1,
    executor: Executor | None = None,
    progress: Callable[[float, int], object] | None = None,
) -> ManyIdentifications:
    """Fits a model to each of many actuators: hysteresis and dead time, as `identify` does for one.

    Driven alike (one u for all), actuators share what depends on the drive alone: where to start and the first step take no pass over
    the operators. Each is then fitted by itself on all of its samples. The fit is as good as that of `identify`; where several minima
    of the error are nearly as deep, it may be another one. Driven each by its own drive, they get the very fit of `identify`.

    All samples count: glitches are not looked for, as `identify` does with its `loss`. A position with glitches is fitted badly.

    Parameters
    ----------
    u : array of shape (samples,) or (samples, M)
        The drive of all actuators (V), or one for each.
    Y : array of shape (samples, M)
        The measured positions (um), a column for each actuator.
    dt : float, optional
        Sampling interval in seconds. Without it dead times are in samples.
    model, ratios, input_offset, dead_time, thresholds
        As for `identify`, the same for all actuators.
    operators : int or "auto"
        One number for all. It stays 20 where `identify` would double it.
    weights : "auto", "free", "quadratic" or "split"
        One law for all. "auto" asks the first, the middle and the last actuator that can be fitted, as `identify` would, and takes
        the answer with the most unknowns; so it does with "auto" operators. Of a smoothness it takes the middle one.
    smoothness : float or "auto"
        As for `identify`, one for all.
    skip : int or str
        Leading samples that set the memory but are not fitted, or a time such as "2s".
    threads : int
        So many share out the actuators. The result has the same bits for any number of threads.
    executor : concurrent.futures.Executor, optional
        Takes the actuators in groups of 256, each as a call of this function with `threads`. The same bits again. Everything goes
        through pickle if it has processes.
    progress : callable, optional
        Called with (share done, actuators done). Ctrl-C stops either way; calls that an executor has begun run to their end.

    Returns
    -------
    ManyIdentifications
        An actuator that cannot be fitted (a sample that is not finite, a position that never moves) has its reason in `errors`, and
        takes nothing from the others.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
    >>> gains = [1.0, 1.25, 0.75]
    >>> Y = np.column_stack([gain * mh.paper.table_1_recovered().forward().run(u) for gain in gains])
    >>> found = mh.identify_many(u, Y, dt=0.01, weights="quadratic", smoothness=0.0, threads=2)
    >>> found
    <ManyIdentifications of 3 actuators, 20 operators: 3 green, 0 amber, 0 red>
    >>> bool(found.nrmse.max() < 1e-3)
    True
    >>> inverse = found.actuator_array().inverse(limits=(-500.0, 500.0))
    >>> drive = inverse.step([2.0, 2.0, 2.0])  # V
    >>> bool(drive[1] < drive[0] < drive[2])
    True
    """

def identify_dynamics(
    u: ArrayLike,
    y: ArrayLike,
    model: _Model,
    *,
    dt: float,
    order: Literal["auto", 1, 2] = 2,
    dead_time: Literal["fit"] | float = "fit",
    creep: Literal["auto", "log"] | int | ArrayLike | None = None,
    skip: int = 0,
) -> DynamicsIdentification:
    """Fits the linear part behind a known hysteresis model to a measured record: the cascade of Remark 1 of the paper.

    y = output_offset + gain G[creep[v]], v = model.forward().run(u), G of second order or a first-order lag, with a dead time,
    discretised exactly. y[k] is read at the moment at which u[k] is put out. v is at rest at its first value before the record,
    so start a step record a sample or more before the step.

    Parameters
    ----------
    u, y : arrays of n floats
        Input (V) and measured output (um): a chirp or a step that reaches the resonance.
    model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        From a slow record, by `identify`.
    dt : float
        Sampling interval in seconds.
    order : 2 or 1
        Second-order dynamics or a first-order lag. Searched up to half the sampling rate.
    dead_time : "fit" or float
        What y lags u besides, in seconds: searched up to a tenth of the record.
    creep : None, "auto", int or array
        Log-type creep with one amplitude, so many terms a decade apart, or these time constants in seconds.
    skip : int
        Leading samples that set the memory but are not fitted.

    Returns
    -------
    DynamicsIdentification

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> model = mh.paper.table_1_recovered()
    >>> u = np.where(np.arange(500) < 10, 0.0, 400.0)  # V, a step
    >>> y = mh.plant.SecondOrder(800.0, 0.05).response(model.forward().run(u), dt=1e-4)  # um, a record: yours is measured
    >>> found = mh.identify_dynamics(u, y, model, dt=1e-4)
    >>> round(found.dynamics.frequency, 3), round(found.dynamics.damping, 5), found.warnings
    (800.0, 0.05, [])
    """

@final
class Plant:
    """A stage between its two converters, as a controller sees it: drive in, measurement out.

    `measured` and `position` are those of now; `step(drive)` holds the drive for `dt` and returns the next measurement, read
    just before the next drive is put out. `run(drives)` returns the rows of a record instead. A plant starts at rest: the drive
    has been 0, or the limit nearest to it, since forever. A drive beyond the limits is clamped, one that is not finite leaves
    the one before; either is counted.

    Parameters
    ----------
    stage : Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        A model with the keywords `dynamics`, `amplifier_bandwidth`, `creep`, `dead_time`, `noise` and `limits`, which mean what
        they mean for a Stage, makes a stage.
    dt : float
        Sampling interval in seconds.
    seed : int
        Seed of the noise: the same seed gives the same numbers. White Gaussian noise by xoshiro256++ and the ziggurat method.
    dac_bits : int, optional
        D/A converter: the nearest of 2^bits levels from one limit to the other, both included. Needs `limits`.
    adc_bits, adc_range : int and (low, high), optional
        A/D converter: the nearest of 2^bits levels from low to high, in the unit of the position.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> plant = mh.plant.Plant(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016,
    ...                        limits=(-560.0, 560.0), dac_bits=16, adc_bits=24, adc_range=(-5.0, 5.0), dt=1e-4, seed=1)
    >>> measured, position = plant.run([300.0] * 100)
    >>> bool(abs(position[0]) < 1e-3), bool(abs(position[-1] - plant.position) < 1e-3)
    (True, True)
    >>> plant.reset()
    >>> bool(plant.step(300.0) == measured[1])
    True
    >>> _ = plant.step(float("nan")), plant.step(900.0)
    >>> plant.drive, plant.rejected, plant.clamped
    (560.0, 1, 1)
    """

    def __new__(
        cls,
        stage: _Model | Stage,
        *,
        dt: float,
        seed: int = 0,
        dac_bits: int | None = None,
        adc_bits: int | None = None,
        adc_range: Sequence[float] | None = None,
        dynamics: _Dynamics | None = None,
        amplifier_bandwidth: float | None = None,
        creep: Creep | None = None,
        dead_time: float = 0.0,
        noise: float | None = None,
        limits: Sequence[float] | None = None,
    ) -> Plant: ...
    def step(self, drive: float) -> float:
        """Holds the drive for one sampling interval and returns the measurement at its end."""
    def read(self) -> float:
        """The measurement of now: `measured`. With `write` a plant is used as hardware is, as `simulate` does with any object."""
    def write(self, drive: float) -> None:
        """Holds the drive for one sampling interval: `step` without the measurement, which `read` returns."""
    def run(self, drives: ArrayLike) -> tuple[_Vector, _Vector]:
        """Takes an array of drives and returns the rows of a record, (measured, position): both at the moment at which the drive
        is put out.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, oldest drive first, one per sampling interval."""
    def reset(self) -> None:
        """Back to the start, at rest: the same drives give the same measurements again, noise included."""
    @property
    def stage(self) -> Stage:
        """The stage between the converters."""
    def copy(self) -> Plant:
        """A plant in the same state that goes on by itself."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the plant remembers, as a dictionary to keep; set it to continue from there bit for bit, noise included."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    @property
    def measured(self) -> float:
        """The measurement of now, um."""
    @property
    def position(self) -> float:
        """The true position of now, um."""
    @property
    def drive(self) -> float:
        """The drive that the D/A converter put out last, V."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits of the drive (low, high), or None."""
    @property
    def dt(self) -> float:
        """Sampling interval in seconds."""
    @property
    def sub_steps(self) -> int:
        """Sub-steps per sample: 1, or 8 to 64 if an amplifier comes before hysteresis and dynamics:
        ceil(16 2 pi (f_amplifier + f_dynamics) dt).
        """
    @property
    def rejected(self) -> int:
        """How many drives were not finite, or beyond 1e100: the one before was held."""
    @property
    def clamped(self) -> int:
        """How many drives were clamped to the limits."""
    @property
    def overrange(self) -> int:
        """How many measurements were clamped to the range of the A/D converter."""

@final
class Metrics:
    """The errors of a run, or of a part of it.

    The measured error is reference - measured, what the paper plots; the position error is reference - position, what
    matters, and free of measurement noise. Samples without a reading are left out of the measured errors, those whose
    position is not known (NaN) out of the position errors. Where nothing is left, these errors are NaN.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
    >>> run = stage.simulate(mh.signals.sine(1.0, 10.0, seconds=0.2), dt=1e-4)
    >>> run.metrics.max_position_error < 0.01, run.metrics.saturated_count  # um
    (True, 0)
    """

    @property
    def samples(self) -> int:
        """How many samples they are of."""
    @property
    def max_error(self) -> float:
        """Largest magnitude of the measured error, um."""
    @property
    def rmse(self) -> float:
        """Root mean square of the measured error, um."""
    @property
    def max_position_error(self) -> float:
        """Largest magnitude of the position error, um."""
    @property
    def position_rmse(self) -> float:
        """Root mean square of the position error, um."""
    @property
    def range(self) -> float:
        """Peak-to-peak of the reference, um: the base of `hysteresis_percent`."""
    @property
    def hysteresis_percent(self) -> float | None:
        """Largest magnitude of the measured error in % of `range`, or None if the reference does not move or nothing was read. What the paper
        calls hysteresis in Fig. 12 and 13, but for rounding (erratum 15).
        """
    @property
    def drive_low(self) -> float:
        """Lowest drive, V."""
    @property
    def drive_high(self) -> float:
        """Highest drive, V."""
    @property
    def saturated_count(self) -> int:
        """At how many samples the drive was at a limit of the plant."""
    @property
    def missing_count(self) -> int:
        """At how many samples there was no reading."""

@final
class Run:
    """The samples of a closed loop and the errors in them: made by `simulate`, or from a record of your own.

    At the moment of sample k the position is position[k]; the controller reads measured[k], knows reference[k], and puts
    out drive[k], which is held until the next sample.

    Parameters
    ----------
    reference, measured, position, drive : arrays of n floats
        um, um, um and V.
    limits : (low, high), optional
        Of the drive: what counts as saturated.
    period : float, optional
        Of the reference, in samples: `settled` leaves out the first.

    Raises
    ------
    ValueError, TypeError
        That name the argument and the sample: four arrays of the same length, at least one sample, all finite.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> run = mh.plant.Run([0.0, 2.0, 0.0, -2.0], [0.0, 1.5, 0.25, -2.0], [0.0, 1.75, 0.0, -2.0], [9.0, 0.0, -9.0, 0.0],
    ...              limits=(-9.0, 9.0), period=2)
    >>> run.metrics.max_error, run.metrics.max_position_error, run.metrics.saturated_count
    (0.5, 0.25, 2)
    >>> run.metrics.hysteresis_percent, run.settled.max_error
    (12.5, 0.25)
    """

    def __new__(
        cls,
        reference: ArrayLike,
        measured: ArrayLike,
        position: ArrayLike,
        drive: ArrayLike,
        *,
        limits: Sequence[float] | None = None,
        period: float | None = None,
    ) -> Run: ...
    @property
    def reference(self) -> _Vector:
        """Where the position should be, um."""
    @property
    def measured(self) -> _Vector:
        """What the controller read, um; NaN where there was no reading."""
    @property
    def position(self) -> _Vector:
        """Where the position was, um; NaN where it is not known."""
    @property
    def drive(self) -> _Vector:
        """What was put out, V: quantised, within the limits, held where the controller gave no number."""
    @property
    def limits(self) -> tuple[float, float] | None:
        """The limits of the drive (low, high), or None."""
    @property
    def period(self) -> float | None:
        """The period of the reference in samples, or None."""
    @property
    def metrics(self) -> Metrics:
        """The errors of the whole run."""
    @property
    def settled(self) -> Metrics | None:
        """The errors after the first period, or None if no period was given."""
    def __len__(self) -> int: ...
    def plot(
        self,
        *,
        dt: float | None = None,
        units: _Units = None,
        axes: Sequence[Axes] | None = None,
    ) -> Figure:
        """Draw it with `mpi_hyst.plot.run`, which has the arguments."""
    def report(
        self,
        path: str | PathLike[str],
        *,
        dt: float,
        name: str = "closed loop",
        units: _Units = None,
    ) -> None:
        """Write a report as one HTML file: `mpi_hyst.reports.run`, which has the arguments."""
    def _repr_html_(self) -> str: ...

@final
class MultiAxisPlant:
    """Several plants that move the same axes: an XY stage with crosstalk, or a tip-tilt-piston mirror on three actuators.

    y = K p, with p the positions of the single plants and y those of the axes. Sensor i shows measured_i = y_i + noise_i; noise_i is
    what the sensor of plant i adds, its `measured` minus its `position`. Drive i goes to plant i. The rest is as for `Plant`, with arrays of N
    numbers, one for each axis: `step(drives)` holds the drives for `dt` and returns the next measurements.

    Parameters
    ----------
    plants : list of N Plants
        With the same `dt`. Copies are taken, in the state in which they are. Plants of the same seed have the same noise.
    coupling : array of shape (N, N)
        K, in the unit of the axes over that of the plants: finite, with a condition number (of the largest column sum) of at most 1e10.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> x, y = (mh.paper.plant("A1", seed=seed) for seed in (1, 2))
    >>> stage = mh.plant.MultiAxisPlant([x, y], [[1.0, 0.03], [-0.03, 1.0]])
    >>> measured, position = stage.run(np.tile([300.0, 0.0], (200, 1)))
    >>> position.shape, bool(np.isclose(position[-1, 1], -0.03 * position[-1, 0]))
    ((200, 2), True)
    >>> bool(np.allclose(stage.position, stage.coupling @ [plant.position for plant in stage.plants]))
    True
    """

    def __new__(cls, plants: Iterable[Plant], coupling: ArrayLike) -> MultiAxisPlant: ...
    def step(self, drives: ArrayLike) -> _Vector:
        """Holds the drives for one sampling interval and returns the measurements at its end."""
    def read(self) -> _Vector:
        """The measurements of now, as an array that is yours."""
    def write(self, drives: ArrayLike) -> None:
        """Holds the drives for one sampling interval: `step` without the measurements, which `read` returns."""
    def run(self, drives: ArrayLike) -> tuple[_Matrix, _Matrix]:
        """Takes drives of shape (samples, N) and returns the rows of a record, (measured, position), both of that shape and at
        the moment at which the drives are put out.
        """
    def reset(self) -> None:
        """Back to the start, at rest: the same drives give the same measurements again, noise included."""
    @property
    def plants(self) -> tuple[Plant, ...]:
        """The single plants, as copies in their present states."""
    @property
    def coupling(self) -> _Matrix:
        """K, as an array of shape (N, N)."""
    def copy(self) -> MultiAxisPlant:
        """A plant in the same state that goes on by itself."""
    @property
    def measured(self) -> _Vector:
        """The measurements of now."""
    @property
    def position(self) -> _Vector:
        """The true positions of now."""
    @property
    def drive(self) -> _Vector:
        """The drives that were put out last, V."""
    @property
    def limits(self) -> _Matrix:
        """The limits of the drives, an array of shape (N, 2): infinite where a plant has none."""
    @property
    def dt(self) -> float:
        """Sampling interval in seconds."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the plants remember, as a dictionary to keep; set it to continue from there bit for bit, noise included."""
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    def __len__(self) -> int: ...

@final
class MultiAxisController:
    """Several axes that move each other, as those of an XY stage or a tip-tilt mirror: a HybridController for each actuator, behind a static decoupling.

    A plant with the coupling K moves its axes to y = K p when its actuators are at p. Actuator i gets the reference (D r)_i and the
    measurement (D y)_i, with the decoupling D, usually the inverse of K: u_i = C_i((D r)_i, (D y)_i). So each
    actuator has a loop of its own, with the model of its own hysteresis. Its limits, slew, filters and gates are those of its controller, in the
    coordinates of the actuator.

    Products are summed from the first axis on and leave out zero entries of D. So with the identity the drives are bit for bit
    those of the single controllers. A measurement that is not finite (or beyond 1e100) is a missing one for all
    actuators that depend on it, by an entry of D that is not zero; such a reference is a bad one for them. The other actuators go on.

    Parameters
    ----------
    controllers : list of N HybridControllers
        With the same `dt`, and previews of the same length that look equally far ahead, or none. Copies are taken, in the state in which they
        are.
    decoupling : array of shape (N, N), optional
        D: finite, with a condition number (of the largest column sum) of at most 1e10. Without one the axes are those of the
        actuators.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> coupling = np.array([[1.0, 0.03], [-0.03, 1.0]])
    >>> stage = mh.plant.MultiAxisPlant([mh.paper.plant("A1", seed=seed) for seed in (1, 2)], coupling)
    >>> kp, ki = mh.paper.gains("A1")
    >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
    >>> single = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
    >>> axes = mh.control.MultiAxisController([single, single], np.linalg.inv(coupling))
    >>> axes.step([0.5, 0.0], stage.measured).shape
    (2,)
    >>> axes.reset()
    >>> x = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
    >>> runs = mh.plant.simulate(axes, stage, np.column_stack([x, np.zeros(x.size)]), period=500)
    >>> runs[1].settled.max_position_error < 0.06  # um: noise; without decoupling 0.1 of the crosstalk are left
    True
    """

    def __new__(
        cls, controllers: Iterable[HybridController], decoupling: ArrayLike | None = None
    ) -> MultiAxisController: ...
    def step(
        self,
        references: ArrayLike,
        measurements: ArrayLike,
        out: _Vector | None = None,
        *,
        targets: ArrayLike | None = None,
        corrections: ArrayLike | None = None,
        feedforward: ArrayLike | None = None,
    ) -> _Vector:
        """Takes a sample and returns the drives in volts, in `out` or a new array of shape (N,).

        `references` and `measurements` of the axes, arrays of N numbers; with previews the references of `preview.ahead` samples later.
        `targets` of the axes, if the feed-forward is to reach something else; `corrections`: what is added to them; `feedforward`: volts of the actuators that replace its output.
        """
    def peek(
        self,
        references: ArrayLike,
        measurements: ArrayLike,
        out: _Vector | None = None,
        *,
        targets: ArrayLike | None = None,
        corrections: ArrayLike | None = None,
        feedforward: ArrayLike | None = None,
    ) -> _Vector:
        """The drives that `step` would return, without taking the sample."""
    def plan(
        self,
        references: ArrayLike,
        measurements: ArrayLike,
        out: _Vector | None = None,
        *,
        targets: ArrayLike | None = None,
        corrections: ArrayLike | None = None,
        feedforward: ArrayLike | None = None,
    ) -> _Vector:
        """The drives for a sample, which only `commit` takes: write them to the amplifiers between the two, and if that fails, leave
        it.

        A plan replaces the one before; any change of a controller drops it.
        """
    def commit(self) -> bool:
        """Takes the sample that was planned, on all axes; False, and none moves on, if there is no plan."""
    def run(
        self, references: ArrayLike, measurements: ArrayLike, out: _Matrix | None = None
    ) -> _Matrix:
        """Takes references and measurements of shape (samples, N), bit for bit like `step` in a loop; returns the drives, in `out`
        or a new array of that shape.
        """
    @property
    def controllers(self) -> tuple[HybridController, ...]:
        """The single controllers, as copies in their present states."""
    @property
    def decoupling(self) -> _Matrix:
        """D, as an array of shape (N, N)."""
    @property
    def drive(self) -> _Vector:
        """The present drives in volts: what the amplifiers have."""
    @property
    def limits(self) -> _Matrix:
        """The limits of the drives in volts, an array of shape (N, 2)."""
    @property
    def terms(self) -> tuple[ControllerTerms, ...]:
        """What the last samples of the actuators that were acted upon were made of, N ControllerTerms."""
    @property
    def lead_in(self) -> float:
        """For how many seconds at most the drives are not yet those of the law, from the next sample on: until the windows of the
        previews are full and the bumpless terms are gone.
        """
    @property
    def kp(self) -> _Vector:
        """The proportional gains of the actuators in V/um, an array of N."""
    @property
    def ki(self) -> _Vector:
        """The integral gains of the actuators in V/um/s, an array of N."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds."""
    def set_gains(self, axis: int, kp: float, ki: float) -> None:
        """Changes the gains of actuator `axis`, counted from 0, without a jump: as `HybridController.set_gains`.

        A change of one actuator drops what is planned for all. What is refused leaves all as it was.
        """
    def set_filters(self, axis: int, filters: _Filter | Sequence[_Filter]) -> None:
        """Changes the filters of actuator `axis`, counted from 0, without a jump: as `HybridController.set_filters`."""
    def set_model(self, axis: int, model: _Model) -> None:
        """Actuator `axis`, counted from 0, goes on with the weights and the output offset of another model of the same operators,
        without a jump: as `HybridController.set_model`.

        Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; all is as before
        then.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> model, limits = mh.paper.table_1_recovered(), (-500.0, 500.0)
        >>> single = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=6e3, dt=1e-4, limits=limits)
        >>> axes = mh.control.MultiAxisController([single, single])
        >>> for _ in range(60):
        ...     before = axes.step([1.0, 0.5], [1.0, 0.5])
        >>> stiffer = mh.ModifiedPrandtlIshlinskii(0.9 * model.weights, model.r, model.ra, model.rb, model.rc)
        >>> axes.set_model(0, stiffer)
        >>> axes.set_gains(1, kp=4.0, ki=5e3)
        >>> bool(abs(axes.step([1.0, 0.5], [1.0, 0.5]) - before).max() < 1.0)  # V: no jump
        True
        >>> axes.kp.tolist(), axes.mode
        ([5.0, 4.0], ('run', 'run'))
        """
    def set_feedforward(self, axis: int, feedforward: _FeedForward) -> None:
        """Actuator `axis`, counted from 0, goes on with another feed-forward without a jump: as `HybridController.set_feedforward`."""
    @property
    def mode(self) -> tuple[Literal["run", "feedforward", "hold", "stop"], ...]:
        """What each actuator does with its samples, N words: "run"; "feedforward": the proportional term is off, the integral is
        frozen and stays part of the drive; "hold": the drive stays and nothing advances; "stop", which `stop` begins.

        Set one of the first three at any time, or a list of N of them: no change of mode is a jump.
        """
    @mode.setter
    def mode(
        self,
        mode: Literal["run", "feedforward", "hold"]
        | Sequence[Literal["run", "feedforward", "hold"]],
    ) -> None: ...
    @property
    def hold(self) -> bool:
        """Whether all drives are held. An attribute: set it to True to hold, to False to go on in the mode before, also after a
        stop.
        """
    @hold.setter
    def hold(self, hold: bool) -> None: ...
    def stop(self, rate: float, rest_drives: ArrayLike | None = None) -> None:
        """Ramps every drive to its rest drive (V, an array of N, by default zeros) at `rate` (V/s), or at its slew if that is slower, and
        holds it there.

        From the next sample on every `step` puts out the next drives of the ramps, for any references and measurements. `hold = False` starts a motion
        from the drives that are reached then.
        """
    def reset(self, drives: ArrayLike | None = None) -> None:
        """All axes back to the start, in mode "run", with all counters at zero. The drives stay as they are, or are `drives` if the
        amplifiers have others now.
        """
    def follow(self, drives: ArrayLike) -> None:
        """Takes over what was driven before, an array of shape (samples, N), oldest drives first, one row per sampling interval; the
        next motion starts from the last row.
        """
    def start_at(self, drives: ArrayLike) -> None:
        """Goes on from other drives that the amplifiers have, with everything that is remembered."""
    @property
    def state(self) -> dict[str, Any]:
        """Everything that the axes remember, as a dictionary to keep; set it to continue from there bit for bit. The amplifiers must
        be at its drives. Axes with another decoupling, other gains, dt or limits refuse it.
        """
    @state.setter
    def state(self, state: dict[str, Any]) -> None: ...
    @property
    def rejected_count(self) -> NDArray[np.uint64]:
        """How many references, targets or given feed-forwards of each actuator were not finite, or beyond 1e100, or missing."""
    @property
    def missing_count(self) -> NDArray[np.uint64]:
        """How many measurements each actuator missed: one that it depends on was not finite, or beyond 1e100."""
    @property
    def implausible_count(self) -> NDArray[np.uint64]:
        """How many measurements of each actuator were finite but out of their range, or too far from the last one."""
    @property
    def saturated_count(self) -> NDArray[np.uint64]:
        """How many samples asked for a drive of each actuator beyond its limits."""
    @property
    def slewing_count(self) -> NDArray[np.uint64]:
        """How many samples asked for a faster move of each actuator than its slew allows."""
    def __len__(self) -> int: ...

@type_check_only
class _Controller(Protocol):
    def step(self, reference: float, measurement: float, /) -> SupportsFloat: ...

@type_check_only
class _Plant(Protocol):
    def read(self) -> SupportsFloat: ...
    def write(self, drive: float, /) -> object: ...

@type_check_only
class _AxesController(Protocol):
    def step(self, references: _Vector, measurements: _Vector, /) -> _Vector | Sequence[float]: ...

@type_check_only
class _AxesPlant(Protocol):
    def read(self) -> _Vector | Sequence[float]: ...
    def write(self, drives: _Vector, /) -> object: ...

@overload
def simulate(  # type: ignore[overload-overlap]
    controller: MultiAxisController,
    plant: MultiAxisPlant | _AxesPlant,
    reference: ArrayLike,
    *,
    target: ArrayLike | None = None,
    period: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> list[Run]:
    """Lets a plant follow a reference under a controller, from the state in which both are.

    At sample k the controller sees reference[k] and the plant's measurement, and gives the drive, which the plant holds
    for one sampling interval. With a `HybridController` and a `Plant` the loop runs in compiled code. With
    any other controller its `step(reference, measurement)` is called. A reference that is not finite is refused before
    anything moves. An exception ends the run and leaves controller and plant where they are. A controller or a plant in
    Python cannot use the other one itself meanwhile.

    A plant may be any object with `read() -> float` and `write(drive)`: hardware, another process, a model of your own. At
    every sample its measurement is read, and the drive is written. `write` holds the drive for one sampling interval, and
    `read` waits for its end if time passes. Where it has these attributes they are used too: `position`, where it really is (else
    what was measured); `drive`, what it really puts out (else what was written); `limits` (low, high) of the drive and `dt` in
    seconds, to which the controller is compared. What it raises passes through unchanged. If `write` raises, a `HybridController` with its
    observer and learning, and an `identifier`, have not taken that sample: the next one starts from the drive before. Such a plant gets finite drives only: a controller that gives another number is refused.

    A reading of NaN is a missing measurement. The controller counts it and goes on as its `max_missing` says: with the estimate of an
    observer, if it has one. In the run `measured` is NaN there, and `missing_count` of the metrics counts it. The measured errors are those of the
    other samples.

    Several axes: a `MultiAxisController`, or an object whose `step(references, measurements)` takes and returns arrays of N numbers,
    with a `MultiAxisPlant` or an object whose `read` returns and whose `write` takes N numbers. The reference is an
    array of shape (samples, N). Then the result is a list of N runs: run i has reference, measurement and position of axis i, and drive and limits of
    actuator i. Of the keywords `target` (an array as the reference), `period` and `progress` can be used.

    Parameters
    ----------
    controller : HybridController, MultiAxisController or object
        With a method step(reference, measurement) -> drive. A preview gets its references early: before the run, the plant
        stands at reference[0] for as many samples.
    plant : Plant, MultiAxisPlant or object
        What is driven: with read() -> measurement and write(drive).
    reference : array of n floats, or of shape (n, N)
        Where the position should be, um, at the plant's sampling interval.
    target : array of n floats, optional
        Of the feed-forward, if it is not the reference: what `invert_dynamics` makes of it.
    correction : array of n floats, optional
        What is added to the target at every sample: `IterativeLearning.correction`, period after period.
    observer, repetitive : Observer, RepetitiveControl, optional
        As parts of the controller for this run: see `HybridController`. They remember it.
    identifier : RecursiveIdentifier, optional
        Follows drive and measurement; its model is taken into the controller every `model_update_interval` samples, without a jump.
        For an exact inverse as feed-forward.
    model_update_interval : int
        Samples between two swaps.
    period : float, optional
        Of the reference, in samples: `settled` of the run leaves out the first.
    progress : callable, optional
        Called with the fraction done, now and then.

    Returns
    -------
    Run, or a list of N of them

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came; of a plant that is an object also the sample.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> kp, ki = mh.paper.gains("A1")
    >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
    >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
    >>> controller = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error > 0.2  # um: the dynamics lag
    True
    >>> controller = mh.control.HybridController(
    ...     inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560),
    ...     preview=mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
    ... )
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error < 0.01
    True
    >>> class Bench:  # hardware, another process or, as here, a lag of 5 nm/V
    ...     position = 0.0
    ...     def read(self) -> float:
    ...         return self.position
    ...     def write(self, drive: float) -> None:
    ...         self.position += 0.2 * (5e-3 * drive - self.position)
    >>> gains = {"kp": 20.0, "ki": 2e4, "dt": 1e-4, "limits": (-500.0, 500.0)}
    >>> feedback = mh.control.HybridController(None, **gains)
    >>> run = mh.plant.simulate(feedback, Bench(), mh.signals.sine(1.0, 5.0, seconds=0.2))
    >>> run.metrics.max_position_error < 0.4, run.metrics.missing_count
    (True, 0)
    """

@overload
def simulate(
    controller: _AxesController,
    plant: MultiAxisPlant | _AxesPlant,
    reference: ArrayLike,
    *,
    target: ArrayLike | None = None,
    period: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> list[Run]:
    """Lets a plant follow a reference under a controller, from the state in which both are.

    At sample k the controller sees reference[k] and the plant's measurement, and gives the drive, which the plant holds
    for one sampling interval. With a `HybridController` and a `Plant` the loop runs in compiled code. With
    any other controller its `step(reference, measurement)` is called. A reference that is not finite is refused before
    anything moves. An exception ends the run and leaves controller and plant where they are. A controller or a plant in
    Python cannot use the other one itself meanwhile.

    A plant may be any object with `read() -> float` and `write(drive)`: hardware, another process, a model of your own. At
    every sample its measurement is read, and the drive is written. `write` holds the drive for one sampling interval, and
    `read` waits for its end if time passes. Where it has these attributes they are used too: `position`, where it really is (else
    what was measured); `drive`, what it really puts out (else what was written); `limits` (low, high) of the drive and `dt` in
    seconds, to which the controller is compared. What it raises passes through unchanged. If `write` raises, a `HybridController` with its
    observer and learning, and an `identifier`, have not taken that sample: the next one starts from the drive before. Such a plant gets finite drives only: a controller that gives another number is refused.

    A reading of NaN is a missing measurement. The controller counts it and goes on as its `max_missing` says: with the estimate of an
    observer, if it has one. In the run `measured` is NaN there, and `missing_count` of the metrics counts it. The measured errors are those of the
    other samples.

    Several axes: a `MultiAxisController`, or an object whose `step(references, measurements)` takes and returns arrays of N numbers,
    with a `MultiAxisPlant` or an object whose `read` returns and whose `write` takes N numbers. The reference is an
    array of shape (samples, N). Then the result is a list of N runs: run i has reference, measurement and position of axis i, and drive and limits of
    actuator i. Of the keywords `target` (an array as the reference), `period` and `progress` can be used.

    Parameters
    ----------
    controller : HybridController, MultiAxisController or object
        With a method step(reference, measurement) -> drive. A preview gets its references early: before the run, the plant
        stands at reference[0] for as many samples.
    plant : Plant, MultiAxisPlant or object
        What is driven: with read() -> measurement and write(drive).
    reference : array of n floats, or of shape (n, N)
        Where the position should be, um, at the plant's sampling interval.
    target : array of n floats, optional
        Of the feed-forward, if it is not the reference: what `invert_dynamics` makes of it.
    correction : array of n floats, optional
        What is added to the target at every sample: `IterativeLearning.correction`, period after period.
    observer, repetitive : Observer, RepetitiveControl, optional
        As parts of the controller for this run: see `HybridController`. They remember it.
    identifier : RecursiveIdentifier, optional
        Follows drive and measurement; its model is taken into the controller every `model_update_interval` samples, without a jump.
        For an exact inverse as feed-forward.
    model_update_interval : int
        Samples between two swaps.
    period : float, optional
        Of the reference, in samples: `settled` of the run leaves out the first.
    progress : callable, optional
        Called with the fraction done, now and then.

    Returns
    -------
    Run, or a list of N of them

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came; of a plant that is an object also the sample.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> kp, ki = mh.paper.gains("A1")
    >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
    >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
    >>> controller = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error > 0.2  # um: the dynamics lag
    True
    >>> controller = mh.control.HybridController(
    ...     inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560),
    ...     preview=mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
    ... )
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error < 0.01
    True
    >>> class Bench:  # hardware, another process or, as here, a lag of 5 nm/V
    ...     position = 0.0
    ...     def read(self) -> float:
    ...         return self.position
    ...     def write(self, drive: float) -> None:
    ...         self.position += 0.2 * (5e-3 * drive - self.position)
    >>> gains = {"kp": 20.0, "ki": 2e4, "dt": 1e-4, "limits": (-500.0, 500.0)}
    >>> feedback = mh.control.HybridController(None, **gains)
    >>> run = mh.plant.simulate(feedback, Bench(), mh.signals.sine(1.0, 5.0, seconds=0.2))
    >>> run.metrics.max_position_error < 0.4, run.metrics.missing_count
    (True, 0)
    """

@overload
def simulate(
    controller: _Controller,
    plant: _Plant,
    reference: ArrayLike,
    *,
    target: ArrayLike | None = None,
    correction: ArrayLike | None = None,
    observer: Observer | None = None,
    repetitive: RepetitiveControl | None = None,
    identifier: RecursiveIdentifier | None = None,
    model_update_interval: int = 1000,
    period: float | None = None,
    progress: Callable[[float], object] | None = None,
) -> Run:
    """Lets a plant follow a reference under a controller, from the state in which both are.

    At sample k the controller sees reference[k] and the plant's measurement, and gives the drive, which the plant holds
    for one sampling interval. With a `HybridController` and a `Plant` the loop runs in compiled code. With
    any other controller its `step(reference, measurement)` is called. A reference that is not finite is refused before
    anything moves. An exception ends the run and leaves controller and plant where they are. A controller or a plant in
    Python cannot use the other one itself meanwhile.

    A plant may be any object with `read() -> float` and `write(drive)`: hardware, another process, a model of your own. At
    every sample its measurement is read, and the drive is written. `write` holds the drive for one sampling interval, and
    `read` waits for its end if time passes. Where it has these attributes they are used too: `position`, where it really is (else
    what was measured); `drive`, what it really puts out (else what was written); `limits` (low, high) of the drive and `dt` in
    seconds, to which the controller is compared. What it raises passes through unchanged. If `write` raises, a `HybridController` with its
    observer and learning, and an `identifier`, have not taken that sample: the next one starts from the drive before. Such a plant gets finite drives only: a controller that gives another number is refused.

    A reading of NaN is a missing measurement. The controller counts it and goes on as its `max_missing` says: with the estimate of an
    observer, if it has one. In the run `measured` is NaN there, and `missing_count` of the metrics counts it. The measured errors are those of the
    other samples.

    Several axes: a `MultiAxisController`, or an object whose `step(references, measurements)` takes and returns arrays of N numbers,
    with a `MultiAxisPlant` or an object whose `read` returns and whose `write` takes N numbers. The reference is an
    array of shape (samples, N). Then the result is a list of N runs: run i has reference, measurement and position of axis i, and drive and limits of
    actuator i. Of the keywords `target` (an array as the reference), `period` and `progress` can be used.

    Parameters
    ----------
    controller : HybridController, MultiAxisController or object
        With a method step(reference, measurement) -> drive. A preview gets its references early: before the run, the plant
        stands at reference[0] for as many samples.
    plant : Plant, MultiAxisPlant or object
        What is driven: with read() -> measurement and write(drive).
    reference : array of n floats, or of shape (n, N)
        Where the position should be, um, at the plant's sampling interval.
    target : array of n floats, optional
        Of the feed-forward, if it is not the reference: what `invert_dynamics` makes of it.
    correction : array of n floats, optional
        What is added to the target at every sample: `IterativeLearning.correction`, period after period.
    observer, repetitive : Observer, RepetitiveControl, optional
        As parts of the controller for this run: see `HybridController`. They remember it.
    identifier : RecursiveIdentifier, optional
        Follows drive and measurement; its model is taken into the controller every `model_update_interval` samples, without a jump.
        For an exact inverse as feed-forward.
    model_update_interval : int
        Samples between two swaps.
    period : float, optional
        Of the reference, in samples: `settled` of the run leaves out the first.
    progress : callable, optional
        Called with the fraction done, now and then.

    Returns
    -------
    Run, or a list of N of them

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came; of a plant that is an object also the sample.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> kp, ki = mh.paper.gains("A1")
    >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
    >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
    >>> controller = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error > 0.2  # um: the dynamics lag
    True
    >>> controller = mh.control.HybridController(
    ...     inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560),
    ...     preview=mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
    ... )
    >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
    >>> run.settled.max_position_error < 0.01
    True
    >>> class Bench:  # hardware, another process or, as here, a lag of 5 nm/V
    ...     position = 0.0
    ...     def read(self) -> float:
    ...         return self.position
    ...     def write(self, drive: float) -> None:
    ...         self.position += 0.2 * (5e-3 * drive - self.position)
    >>> gains = {"kp": 20.0, "ki": 2e4, "dt": 1e-4, "limits": (-500.0, 500.0)}
    >>> feedback = mh.control.HybridController(None, **gains)
    >>> run = mh.plant.simulate(feedback, Bench(), mh.signals.sine(1.0, 5.0, seconds=0.2))
    >>> run.metrics.max_position_error < 0.4, run.metrics.missing_count
    (True, 0)
    """

def read_bytes(path: str | PathLike[str]) -> bytes:
    """The bytes of a file, and no more of them than `load` would read."""

def load_from(path: str | PathLike[str], data: bytes) -> _Model | Stage:
    """As `load`, of a file that was read already: a pipe can be read only once."""

def load(path: str | PathLike[str]) -> _Model | Stage:
    """Reads a stage or a model that `save` wrote.

    Parameters
    ----------
    path : str or os.PathLike
        A JSON file of schema "mpi_hyst/stage/1", "mpi_hyst/model/1" or "mpi_hyst/model/2".

    Returns
    -------
    Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is cut off, of another schema, or holds what no stage or model may have.

    Examples
    --------
    >>> import mpi_hyst as mh, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "stage.json"
    >>> mh.paper.table_1().save(path)
    >>> mh.load(path) == mh.paper.table_1()
    True
    """

def c_header_text(
    stage: Stage, name: str, dt: float | None = None, sha256: str | None = None
) -> str:
    """The text of a header of constants: `mpi_hyst.export.c_header` writes it to a file."""

def c_name(text: str) -> str:
    """A name of C made of any text: letters, digits and underscores, no digit first."""

def fmu_texts(
    stage: Stage,
    kind: str,
    name: str,
    dt: float,
    feedforward: str,
    gains: tuple[float, float] | None = None,
) -> tuple[str, str, str, str]:
    """The texts of a functional mock-up unit: identifier, description, settings, stage. `mpi_hyst.export.fmu` packs them."""

def table_1() -> ModifiedPrandtlIshlinskii:
    """Table I as printed: the forward model, input V, output um, for a drive of -500..500 V.

    The printed weights keep one or two digits and are up to 31 % off; `table_1_recovered` is the actuator.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.paper.table_1().operators
    20
    """

def table_1_recovered() -> ModifiedPrandtlIshlinskii:
    """The forward model with the weights that Table II implies: w_i = 1/S'_i - 1/S'_(i-1).

    S'_i is the sum of the first i + 1 weights of Table II. All 20 weights round to those of Table I.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> print(f"{mh.paper.table_1_recovered().forward().step(500.0):+.4f} um")
    +3.0624 um
    """

def table_2() -> ModifiedPrandtlIshlinskii:
    """Table II as printed: the parametric inverse, input um, output V.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> float(mh.paper.table_2().weights[0])
    234.9005
    """

def plant(name: Literal["A1", "P3"], seed: int = 0) -> Plant:
    """A plant that reproduces the published errors: the recovered weights, +-560 V, 10 kHz, noise, and linear dynamics.

    With the positional law u = H^-1[r] + kp e + ki dt sum e, e = r - measured, the gains of `gains(name)`, the bank of
    `table_2()` as H^-1 and a reference of 3.3 um over three periods, the maxima of |e| come out as published: 0.07 um
    for the triangle of 1 Hz, and 0.098, 0.159, 0.224, 0.293 um for sines of 5, 10, 15, 20 Hz within 10 %. With the
    closed-form inverse of the conventional model of the same weights and thresholds as H^-1 the triangle gives 0.10 um,
    as published. Both plants do, so they are a benchmark, not proof of what the paper's stage was.

    Parameters
    ----------
    name : "A1" or "P3"
        "A1": second order, 400 Hz, damping 0.95; noise 16.0 nm rms. "P3": second order, 2 kHz, damping 0.03, after an
        amplifier pole of 279 Hz; noise 16.4 nm rms.
    seed : int
        Seed of the noise: the same seed gives the same numbers.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> class PaperLaw:
    ...     def __init__(self, kp, ki):
    ...         self.kp, self.ki, self.sum = kp, ki, 0.0
    ...         self.feed_forward = mh.paper.table_2().forward()
    ...     def step(self, reference, measurement):
    ...         error = reference - measurement
    ...         self.sum += error * 1e-4  # s
    ...         return self.feed_forward.step(reference) + self.kp * error + self.ki * self.sum
    >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.15)  # um
    >>> run = mh.plant.simulate(PaperLaw(*mh.paper.gains("A1")), mh.paper.plant("A1"), reference)
    >>> bool(abs(run.metrics.max_error / 0.293 - 1.0) < 0.1)
    True
    """

def gains(name: Literal["A1", "P3"]) -> tuple[float, float]:
    """The gains (kp, ki) in V/um and V/um/s, with which the plant of that name gives the published errors.

    Parameters
    ----------
    name : "A1" or "P3"
        The plant.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.paper.gains("A1")
    (60.0, 6000.0)
    """

def sine(
    amplitude: float,
    frequency: float,
    *,
    seconds: float,
    rate: float = 10000.0,
    offset: float = 0.0,
) -> _Vector:
    """offset + amplitude sin(2 pi f t).

    Parameters
    ----------
    amplitude, offset : float
        In the unit of the signal.
    frequency, rate : float
        Cycles and samples per second, in Hz.
    seconds : float
        Duration.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.signals.sine(500.0, 1.0, seconds=2.0, rate=10_000).shape
    (20000,)
    """

def triangle(
    amplitude: float,
    frequency: float,
    *,
    seconds: float,
    rate: float = 10000.0,
    offset: float = 0.0,
) -> _Vector:
    """A triangle that first rises.

    Parameters
    ----------
    amplitude, offset : float
        In the unit of the signal.
    frequency, rate : float
        Cycles and samples per second, in Hz.
    seconds : float
        Duration.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.signals.triangle(2.0, 1.0, seconds=1.0, rate=4)
    array([ 0.,  2.,  0., -2.])
    """

def decaying_triangle(
    amplitude: float, frequency: float, *, cycles: float, rate: float = 10000.0, offset: float = 0.0
) -> _Vector:
    """A triangle of one cycle at full swing, which then shrinks to nothing: a record to identify from, or to demagnetise.

    Parameters
    ----------
    amplitude, offset : float
        Swing at the start, and the value around which the signal swings.
    frequency, rate : float
        Cycles and samples per second, in Hz.
    cycles : float
        Duration, the first cycle at full swing included.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mh.signals.decaying_triangle(1.0, 1.0, cycles=3, rate=4)[1::2]  # the reversals
    array([ 1.   , -1.   ,  0.875, -0.625,  0.375, -0.125])
    """

def chirp(
    amplitude: float,
    start_frequency: float,
    stop_frequency: float,
    *,
    seconds: float,
    rate: float = 10000.0,
    center: float = 0.0,
    sweep: Literal["linear", "logarithmic"] = "linear",
    taper: float = 0.05,
) -> _Vector:
    """A sine whose frequency sweeps: center + amplitude w(t / T) sin(phi(t)), from center to center without a jump.

    The frequency phi' / (2 pi) at the time t is f0 + (f1 - f0) t / T of a linear sweep, f0 (f1 / f0)^(t / T) of a logarithmic
    one, with T the time from the first sample to the last. w fades in along half a cosine, over the share `taper` of T,
    and out again. So the signal changes nowhere faster than amplitude (2 pi max(f0, f1) + pi / (2 taper T)) per second.

    Parameters
    ----------
    amplitude, center : float
        Half of the peak-to-peak swing, and where it starts and ends, in the unit of the signal.
    start_frequency, stop_frequency : float
        f0 and f1 in Hz, at most half of the rate.
    seconds, rate : float
        Duration, and samples per second in Hz.
    sweep : "linear" or "logarithmic"
        Every Hz, or every octave, gets the same time.
    taper : float
        Share of the duration in which the signal fades in, and out: above 0, at most 0.5.

    Raises
    ------
    ValueError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.chirp(2.0, 10.0, 2000.0, seconds=2.0, rate=10_000, center=5.0)
    >>> u.shape, float(u[0]), float(u[-1]), round(float(u.max()), 3)
    ((20000,), 5.0, 5.0, 7.0)
    """

def multisine(
    amplitude: float,
    lines: Sequence[int],
    *,
    samples: int,
    periods: int = 1,
    seed: int | None = None,
    fade: int = 0,
    center: float = 0.0,
) -> _Vector:
    """Sines of many frequencies at once: center + the sum over k in lines of cos(2 pi k n / samples + phi_k), scaled to a peak of
    `amplitude`.

    Line k has the frequency k rate / samples. A discrete Fourier transform over one period holds the lines and nothing
    else, all of one size. The phases are those of Schroeder (1970), which keep the peak low beside the rms: the crest factor
    of neighbouring lines is 1.7 to 2. With a seed they are random, and the crest factor of many lines is 3 to 4.

    Parameters
    ----------
    amplitude, center : float
        The largest distance from the center, and the center, in the unit of the signal.
    lines : sequence of int
        Cycles per period: above 0, below half of `samples`, each once.
    samples : int
        Samples of a period.
    periods : int
        Whole periods.
    seed : int, optional
        Random phases, the same for the same seed. Without it those of Schroeder.
    fade : int
        Samples before the whole periods in which the signal fades in from `center`, and as many behind them. Without
        any the signal begins and ends somewhere within its swing.

    Returns
    -------
    array of periods x samples + 2 fade floats

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> u = mh.signals.multisine(2.0, range(1, 400), samples=5000, periods=4, fade=500)
    >>> u.shape, float(u[0]), float(u[-1]), round(float(abs(u).max()), 6)
    ((21000,), 0.0, 0.0, 2.0)
    """

@final
class ExperimentSegment:
    """A stretch of a drive with a purpose of its own.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> _, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0)
    >>> [segment.name for segment in loops.segments][:3]
    ['start', 'settle', 'major']
    """

    @property
    def name(self) -> str:
        """What it is, in one or two words."""
    @property
    def purpose(self) -> str:
        """What it tells."""
    @property
    def start(self) -> int:
        """Its first sample."""
    @property
    def stop(self) -> int:
        """The sample after its last."""
    @property
    def range(self) -> tuple[float, float]:
        """The lowest and the highest drive."""
    @property
    def frequencies(self) -> tuple[float, float]:
        """The lowest and the highest frequency, in Hz: of loops that of a full stroke at their speed, 0 at rest."""
    @property
    def max_slew(self) -> float:
        """The fastest step, per second."""

@final
class ExperimentPart:
    """A drive to play and record in one go, at one sampling rate: made by `experiment`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> fast, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0, fast_rate=10_000.0)
    >>> fast.rate, loops.drive.size > loops.rate  # Hz; more than a second
    (10000.0, True)
    """

    @property
    def name(self) -> str:
        """ "fast", "loops", or "experiment" if both are joined."""
    @property
    def rate(self) -> float:
        """Samples per second, in Hz."""
    @property
    def drive(self) -> _Vector:
        """The samples, from start to start."""
    @property
    def segments(self) -> list[ExperimentSegment]:
        """What the samples are for: one segment after the other, none left out."""
    @property
    def initialization_samples(self) -> int:
        """How many samples come before both limits were reached: the `skip` of `identify` for an actuator whose history is
        unknown. 0 if the limits are never reached.
        """

def experiment(
    low: float,
    high: float,
    *,
    slew: float,
    rate: float,
    fast_rate: float | None = None,
    frequencies: tuple[float, float] = (1.0, 10.0),
    cycles: int = 20,
    shape: Literal["triangle", "sine"] = "triangle",
    center: float | None = None,
    start: float | None = None,
    rest: float = 10.0,
    fast_signal: Literal["chirp", "multisine"] = "chirp",
    fast_amplitude: float | None = None,
    fast_frequency: float | None = None,
    joined: bool = False,
) -> list[ExperimentPart]:
    """The drives from which a whole stage is identified, within limits and slew rate.

    The parts in the order in which to play them, each from rest at `start` back to it:

    - "fast": a small chirp or multisine for modes and dead time, at `start` or as near to it as both swings stay within
      the limits.
    - "loops": full strokes, decaying and growing loops, small loops about other drives, rests for creep, and full and
      decaying loops again at a second frequency, which tells rate from amplitude.

    The actuator must rest at `start` before, or come from `demagnetize`: then each record is fitted from its first sample.
    Give both records to `identify` as one list, each with its own dt.

    Parameters
    ----------
    low, high : float
        Limits of the drive (V): never left, both reached.
    slew : float
        Largest speed of the drive (V/s): never exceeded from sample to sample.
    rate : float
        Samples per second of the loops, in Hz.
    fast_rate : float, optional
        Samples per second of the fast signal, in Hz: that of the loops unless given.
    frequencies : (float, float)
        Frequencies of a full stroke in Hz, the lower one first. Where the slew rate is too low for the second one, it is
        what the slew rate allows. The first one is at most a third of the second one.
    cycles : int
        Cycles that the loops take to decay, and again to grow.
    shape : "triangle" or "sine"
        Straight moves from reversal to reversal, or half cosines of the same largest speed.
    center : float, optional
        What the reversals decay to: the middle of the limits unless given.
    start : float, optional
        The rest drive, where every part starts and ends: zero, or the limit nearest to it, unless given.
    rest : float
        Duration of each of the four rests, in seconds.
    fast_signal : "chirp" or "multisine"
        The fast signal: 20 000 samples, but at least 2 s and at most 10 s.
    fast_amplitude : float, optional
        Its largest amplitude (V): 1 % of half the range unless given. At high frequencies the slew rate may ask for less.
    fast_frequency : float, optional
        Its highest frequency in Hz: 0.4 of the Nyquist frequency unless given.
    joined : bool
        Whether both parts are one drive, at one rate.

    Returns
    -------
    list of ExperimentPart
        With `name`, `rate`, `drive`, `segments` and `initialization_samples`.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> fast, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0, fast_rate=10_000.0)
    >>> fast
    <ExperimentPart fast: 22009 samples at 10000 Hz, 4 segments>
    >>> print(*(segment.name for segment in loops.segments), sep=", ")
    start, settle, major, decaying, growing, inner, rests, fast major, fast decaying, return, end
    """

@final
class Excitation:
    """An input to identify from: made by `excitation`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> found = mh.signals.excitation(0.0, 150.0, slew=2000.0, rate=2000.0)
    >>> bool(found.drive.min() == 0.0 and found.drive.max() == 150.0)
    True
    """

    @property
    def drive(self) -> _Vector:
        """The samples, from start to start."""
    @property
    def initialization_samples(self) -> int:
        """How many samples come before the memory is known: the `skip` of `identify`."""
    @property
    def reversals(self) -> _Vector:
        """Where the drive turns, in order: one stroke to either limit, one cycle at full swing, the decay."""

def excitation(
    low: float,
    high: float,
    *,
    slew: float,
    rate: float = 10000.0,
    cycles: int = 20,
    shape: Literal["triangle", "sine"] = "triangle",
    center: float | None = None,
    start: float | None = None,
) -> Excitation:
    """A drive to identify from: both limits, one cycle at full swing, then decaying reversals, within a slew limit.

    Once both limits were reached, the memory of an actuator that was never driven beyond them is known: `initialization_samples`
    counts the samples before, to be skipped by `identify`. With as many cycles as the model has operators, a reversal
    on the way up and one on the way down fall between any two neighbouring uniform thresholds. Every reversal is met by
    a sample; small loops take less time than large ones.

    Parameters
    ----------
    low, high : float
        Limits of the drive (V): never left, both reached.
    slew : float
        Largest speed of the drive (V/s): never exceeded from sample to sample.
    rate : float
        Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
    cycles : int
        Decaying cycles after the one at full swing.
    shape : "triangle" or "sine"
        Straight moves from reversal to reversal, or half cosines of the same largest speed.
    center : float, optional
        What the reversals decay to: the middle of the limits unless given.
    start : float, optional
        Where the drive starts and ends: zero, or the limit nearest to it, unless given.

    Returns
    -------
    Excitation
        With `drive`, `initialization_samples` and `reversals`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000.0)
    >>> made
    <Excitation: 11771 samples, 750 of them to initialize, 43 reversals>
    >>> y = mh.paper.table_1_recovered().forward().run(made.drive)
    >>> found = mh.identify(made.drive, y, skip=made.initialization_samples, input_offset=0.0, dead_time=0.0)
    >>> [round(ratio, 4) for ratio in found.ratios]
    [0.95, 0.3, 0.35]
    """

def demagnetize(
    low: float,
    high: float,
    *,
    slew: float,
    rate: float = 10000.0,
    cycles: int = 20,
    shape: Literal["triangle", "sine"] = "triangle",
    center: float | None = None,
    start: float | None = None,
) -> _Vector:
    """A decaying alternation that brings an actuator from any history to its virgin state, within a slew limit.

    Let A be the first amplitude, the smaller distance from `center` to a limit. From any history within `center` +- A
    it leaves every play within A / (4 cycles) of rest, and every coupled play with r >= rb and ra >= rc too, if
    `center` is the input offset of the model. So the output that is left is at most A / (4 cycles) times the sum of
    the weights but the first: of what a stroke of A moves, less than 1 / (4 cycles).

    Parameters
    ----------
    low, high : float
        Limits of the drive (V): never left.
    slew : float
        Largest speed of the drive (V/s): never exceeded from sample to sample.
    rate : float
        Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
    cycles : int
        Cycles that the alternation takes to decay.
    shape : "triangle" or "sine"
        Straight moves from reversal to reversal, or half cosines of the same largest speed.
    center : float, optional
        What the alternation decays to: the middle of the limits unless given.
    start : float, optional
        Where the drive starts and ends: zero, or the limit nearest to it, unless given.

    Returns
    -------
    array of float

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> actuator = mh.paper.table_1_recovered()
    >>> stream = actuator.forward()
    >>> left = stream.run([500.0, 0.0])[-1]                  # um
    >>> drive = mh.signals.demagnetize(-500.0, 500.0, slew=2000.0, rate=1000.0)
    >>> bool(abs(stream.run(drive)[-1]) < 500.0 / (4 * 20) * actuator.weights[1:].sum())
    True
    >>> bool(abs(stream.step(0.0)) < 0.001 * left)
    True
    """

@final
class Sine:
    """r(t) = offset + amplitude sin(2 pi f t), with its derivatives.

    Parameters
    ----------
    amplitude, offset : float
        In the unit of the position.
    frequency : float
        Cycles per second, in Hz.

    Raises
    ------
    ValueError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> position, velocity, acceleration = mh.trajectories.Sine(3.0, 1.0).sample(dt=0.25)
    >>> position.round(12), velocity.round(2)
    (array([ 0.,  3.,  0., -3.]), array([ 18.85,   0.  , -18.85,  -0.  ]))
    """

    def __new__(cls, amplitude: float, frequency: float, *, offset: float = 0.0) -> Sine: ...
    @property
    def amplitude(self) -> float:
        """Half of the peak-to-peak swing."""
    @property
    def frequency(self) -> float:
        """Cycles per second, in Hz."""
    @property
    def offset(self) -> float:
        """The value around which it swings."""
    @property
    def period(self) -> float:
        """Seconds until it starts again."""
    def sample(self, dt: float, seconds: float | None = None) -> tuple[_Vector, _Vector, _Vector]:
        """Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
        per second, and per second squared.

        For `seconds`; by default for one period, or until the end has come.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class RoundedTriangle:
    """A triangle with rounded corners, with its derivatives: straight sides, and a smooth change of velocity at the turns.

    It first rises from its offset and reaches offset +- amplitude exactly. Velocity, acceleration and its derivative
    are continuous.

    Parameters
    ----------
    amplitude, offset : float
        In the unit of the position.
    frequency : float
        Cycles per second, in Hz.
    corner : float
        How many seconds a turn takes, at most half a period.

    Raises
    ------
    ValueError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> scan = mh.trajectories.RoundedTriangle(3.0, 1.0, corner=0.1)
    >>> position, velocity, acceleration = scan.sample(dt=0.25)
    >>> position, abs(velocity).round(3)
    (array([ 0.,  3.,  0., -3.]), array([12.8,  0. , 12.8,  0. ]))
    """

    def __new__(
        cls, amplitude: float, frequency: float, *, corner: float, offset: float = 0.0
    ) -> RoundedTriangle: ...
    @property
    def amplitude(self) -> float:
        """Half of the peak-to-peak swing."""
    @property
    def frequency(self) -> float:
        """Cycles per second, in Hz."""
    @property
    def corner(self) -> float:
        """How many seconds a turn takes."""
    @property
    def offset(self) -> float:
        """The value around which it swings."""
    @property
    def period(self) -> float:
        """Seconds until it starts again."""
    def sample(self, dt: float, seconds: float | None = None) -> tuple[_Vector, _Vector, _Vector]:
        """Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
        per second, and per second squared.

        For `seconds`; by default for one period, or until the end has come.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class PointToPoint:
    """Moves from point to point with rests between, with their derivatives: S-curves, the fastest within the limits.

    Each move starts and ends at rest, on its point exactly, has constant jerk on up to seven pieces and never
    overshoots. Velocity and acceleration are continuous.

    Parameters
    ----------
    points : array of n floats
        Where it starts, and where each move ends.
    velocity, acceleration, jerk : float
        The most of each, in the unit of the position per second, per second squared, and cubed.
    dwell : float
        Seconds of rest at each point between the first and the last.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> moves = mh.trajectories.PointToPoint([0.0, 3.0], velocity=100.0, acceleration=1e4, jerk=1e6)
    >>> round(moves.duration, 6)  # 3 um at 100 um/s, and twice 10 ms of jerk
    0.05
    >>> position, velocity, acceleration = moves.sample(dt=0.01)
    >>> position.round(6)
    array([0.      , 0.166667, 1.      , 2.      , 2.833333, 3.      ])
    """

    def __new__(
        cls,
        points: ArrayLike,
        *,
        velocity: float,
        acceleration: float,
        jerk: float,
        dwell: float = 0.0,
    ) -> PointToPoint: ...
    @property
    def points(self) -> _Vector:
        """Where it starts, and where each move ends, read-only."""
    @property
    def velocity(self) -> float:
        """The most velocity."""
    @property
    def acceleration(self) -> float:
        """The most acceleration."""
    @property
    def jerk(self) -> float:
        """The most jerk."""
    @property
    def dwell(self) -> float:
        """Seconds of rest at each point between the first and the last."""
    @property
    def duration(self) -> float:
        """Seconds until it rests at the last point."""
    def sample(self, dt: float, seconds: float | None = None) -> tuple[_Vector, _Vector, _Vector]:
        """Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
        per second, and per second squared.

        For `seconds`; by default for one period, or until the end has come.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Raster:
    """A raster: the fast axis x goes to and fro at a constant speed, the slow axis y advances.

    On a line x crosses the width at the speed v = width / ((1 - a) T), where T = 0.5 / line_rate, or 1 / line_rate if it is
    bidirectional, and a = `turnaround`. Behind the line it turns round in c = a T seconds: the velocity goes from v to -v along
    v (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5. So x reaches `overscan` = 11/32 v c beyond the image, and accelerates by at most
    `acceleration` = 15/4 v / c. Position, velocity and acceleration are continuous.

    Both axes begin and end at rest. `Stage.precompensate` leads to where they begin with `lead_in`.

    Parameters
    ----------
    width : float
        How long the lines are, without the overscan, in the unit of the position (um).
    height : float
        What the lines cover: they are height / lines apart, each in the middle of its strip. 0 repeats one line.
    lines : int
    line_rate : float
        Lines per second, in Hz.
    turnaround : float
        The share of the time that goes into turning round, above 0 and below 1.
    bidirectional : bool
        Whether the way back is the next line. Else every line is traced, from -width / 2 to width / 2, and retraced.
    steps : bool
        Whether y rests during a line and steps to the next one during the turn. Else it is a ramp, which passes the place of a line
        in the middle of its time.
    center : (x, y)
        Of the image.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import numpy as np
    >>> import mpi_hyst as mh
    >>> raster = mh.trajectories.Raster(10.0, 8.0, 64, line_rate=5.0)
    >>> raster.speed, round(raster.overscan, 3), round(raster.acceleration, 3)  # um/s, um, um/s^2
    (125.0, 0.859, 23437.5)
    >>> x, velocity, acceleration = raster.x.sample(dt=1e-4)
    >>> line = raster.line_index(dt=1e-4)  # -1 in turns and while a line is retraced
    >>> trace = x[line == 7]
    >>> trace.size, bool(np.allclose(np.diff(trace), 125.0 * 1e-4))
    (800, True)
    >>> bool(abs(velocity).max() <= raster.speed), velocity[[0, -1]]
    (True, array([0., 0.]))
    """

    def __new__(
        cls,
        width: float,
        height: float,
        lines: int,
        *,
        line_rate: float,
        turnaround: float = 0.2,
        bidirectional: bool = False,
        steps: bool = False,
        center: tuple[float, float] = (0.0, 0.0),
    ) -> Raster: ...
    @property
    def width(self) -> float:
        """How long the lines are, without the overscan."""
    @property
    def height(self) -> float:
        """What the lines cover."""
    @property
    def lines(self) -> int:
        """How many."""
    @property
    def line_rate(self) -> float:
        """Lines per second, in Hz."""
    @property
    def turnaround(self) -> float:
        """The share of the time that goes into turning round."""
    @property
    def bidirectional(self) -> bool:
        """Whether the way back is the next line."""
    @property
    def steps(self) -> bool:
        """Whether y rests during a line."""
    @property
    def center(self) -> tuple[float, float]:
        """The centre of the image."""
    @property
    def speed(self) -> float:
        """The speed of x on the lines, per second."""
    @property
    def acceleration(self) -> float:
        """The greatest acceleration of x, in the middle of a turn, per second squared."""
    @property
    def overscan(self) -> float:
        """How far x reaches beyond the image on either side."""
    @property
    def line_duration(self) -> float:
        """How many seconds x takes for the width."""
    def line_index(self, dt: float, *, retrace: bool = False) -> NDArray[np.int64]:
        """The line on which each sample of `x.sample(dt)` lies, counted from 0, and -1 for none: an array of integers.

        With `retrace` it is the line that is retraced, else the one that is traced. A bidirectional raster has no retrace.
        """
    @property
    def x(self) -> ScanAxis:
        """The trajectory of x, the fast axis of a raster."""
    @property
    def y(self) -> ScanAxis:
        """The trajectory of y."""
    @property
    def duration(self) -> float:
        """Seconds until both axes rest at the end."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Spiral:
    """An Archimedean spiral from the centre outwards: r = pitch theta / (2 pi), x = r cos theta, y = r sin theta.

    Give it a `frequency` for a constant angular velocity (CAV): both axes are sines of one frequency, whose amplitudes grow. Give it a
    `speed` for a constant linear velocity (CLV): every part of the image is scanned equally fast (Mahmood and Moheimani,
    Nanotechnology 20, 365503, 2009). Near the centre a constant speed would take any angular velocity. So a spiral starts there at
    rest, and its rate is full from `inner_radius` on. The acceleration is at most 1.5 speed^2 / inner_radius, and 1.2
    if the inner radius is a pitch or more. It ends at rest on its radius. Position, velocity and acceleration are continuous.

    Parameters
    ----------
    radius : float
        Where it ends, in the unit of the position (um).
    pitch : float
        How far its turns are apart, at most the radius.
    frequency : float
        Turns per second, in Hz; or
    speed : float
        The speed along the path, in the unit of the position per second.
    inner_radius : float, optional
        From where on the rate is full, at most half of the radius; by default a tenth of it.
    center : (x, y)
        Where it starts.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import numpy as np
    >>> import mpi_hyst as mh
    >>> spiral = mh.trajectories.Spiral(5.0, 0.1, speed=100.0)
    >>> (x, vx, ax), (y, vy, ay) = spiral.x.sample(dt=1e-4), spiral.y.sample(dt=1e-4)
    >>> begin, end = (round(t / 1e-4) for t in spiral.steady)
    >>> bool(np.allclose(np.hypot(vx, vy)[begin:end], 100.0)), round(float(np.hypot(x, y).max()), 6)
    (True, 5.0)
    >>> cav = mh.trajectories.Spiral(5.0, 0.1, frequency=30.0)
    >>> round(cav.duration, 2)  # 50 turns, those near the centre and the end slower
    1.84
    """

    def __new__(
        cls,
        radius: float,
        pitch: float,
        *,
        frequency: float | None = None,
        speed: float | None = None,
        inner_radius: float | None = None,
        center: tuple[float, float] = (0.0, 0.0),
    ) -> Spiral: ...
    @property
    def radius(self) -> float:
        """Where it ends."""
    @property
    def pitch(self) -> float:
        """How far its turns are apart."""
    @property
    def frequency(self) -> float | None:
        """Turns per second, in Hz, if the angular velocity is constant, else None."""
    @property
    def speed(self) -> float | None:
        """The speed along the path, if it is constant, else None."""
    @property
    def inner_radius(self) -> float:
        """From where on the rate is full."""
    @property
    def center(self) -> tuple[float, float]:
        """Where it starts."""
    @property
    def steady(self) -> tuple[float, float]:
        """The times between which the rate is full, in seconds: (begin, end)."""
    @property
    def x(self) -> ScanAxis:
        """The trajectory of x, the fast axis of a raster."""
    @property
    def y(self) -> ScanAxis:
        """The trajectory of y."""
    @property
    def duration(self) -> float:
        """Seconds until both axes rest at the end."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class Lissajous:
    """A Lissajous figure: a sine on each axis, whose amplitudes grow from rest and fade to rest.

    x = e(t) a_x sin(2 pi f_x (t - t_0) + phase), y = e(t) a_y sin(2 pi f_y (t - t_0)), about the center. The envelope e goes from 0 to
    1 along S(s) = 10 s^3 - 15 s^4 + 6 s^5 until the lead-in ends at t_0, and back to 0 behind the figure. Position, velocity and
    acceleration are continuous, and begin and end at rest. The figure repeats itself 1 / g seconds later, g being the greatest
    frequency of which both are whole multiples.

    Parameters
    ----------
    amplitudes : (x, y)
        Half of the swing of each axis, in the unit of the position (um).
    frequencies : (x, y)
        Cycles per second, in Hz.
    seconds : float
        How long the figure takes, without its lead-in and lead-out.
    phase : float
        The phase of x in radians where the lead-in ends; that of y is 0 there.
    lead_in : float, optional
        How many seconds the amplitudes grow, and fade; by default two periods of the slower sine. Then no velocity is greater than in the
        figure, and no acceleration by more than 4 %.
    center : (x, y)
        Where it starts and ends.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> figure = mh.trajectories.Lissajous((5.0, 4.0), (30.0, 29.0), seconds=1.0)
    >>> x, velocity, acceleration = figure.x.sample(dt=1e-4)
    >>> velocity[[0, -1]], round(float(abs(x).max()), 4)
    (array([0., 0.]), 5.0)
    >>> begin, end = figure.steady
    >>> round(end - begin, 12), figure.lead_in == 2.0 / 29.0
    (1.0, True)
    """

    def __new__(
        cls,
        amplitudes: tuple[float, float],
        frequencies: tuple[float, float],
        *,
        seconds: float,
        phase: float = 0.0,
        lead_in: float | None = None,
        center: tuple[float, float] = (0.0, 0.0),
    ) -> Lissajous: ...
    @property
    def amplitudes(self) -> tuple[float, float]:
        """Half of the swing of x and of y."""
    @property
    def frequencies(self) -> tuple[float, float]:
        """Cycles per second of x and of y, in Hz."""
    @property
    def seconds(self) -> float:
        """How many seconds the figure takes, without its lead-in and lead-out."""
    @property
    def phase(self) -> float:
        """The phase of x in radians where the lead-in ends."""
    @property
    def lead_in(self) -> float:
        """How many seconds the amplitudes grow, and fade."""
    @property
    def center(self) -> tuple[float, float]:
        """Where it starts and ends."""
    @property
    def steady(self) -> tuple[float, float]:
        """The times between which the amplitudes are constant, in seconds: (begin, end)."""
    @property
    def x(self) -> ScanAxis:
        """The trajectory of x, the fast axis of a raster."""
    @property
    def y(self) -> ScanAxis:
        """The trajectory of y."""
    @property
    def duration(self) -> float:
        """Seconds until both axes rest at the end."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

@final
class ScanAxis:
    """One axis of a scan, with its derivatives: made by `.x` and `.y` of a `Raster`, `Spiral` or `Lissajous`.

    Both axes of a scan take equally long, so their samples belong together.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> raster = mh.trajectories.Raster(10.0, 8.0, 64, line_rate=5.0)  # um, um, lines, Hz
    >>> position, velocity, acceleration = raster.x.sample(dt=1e-4)
    >>> position.size == round(raster.x.duration / 1e-4) + 1
    True
    """

    @property
    def scan(self) -> Raster | Spiral | Lissajous:
        """The scan to which it belongs."""
    @property
    def name(self) -> Literal["x", "y"]:
        """ "x" or "y"."""
    @property
    def duration(self) -> float:
        """Seconds until it rests at the end."""
    def sample(self, dt: float, seconds: float | None = None) -> tuple[_Vector, _Vector, _Vector]:
        """Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
        per second, and per second squared.

        For `seconds`; by default until the end has come.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

_Trajectory = Sine | RoundedTriangle | PointToPoint | ScanAxis

def preview(
    dynamics: _Dynamics | None,
    dt: float,
    *,
    ahead: int,
    window: int | None = None,
    degree: int | None = None,
    band: float | None = None,
    amplifier_bandwidth: float | None = None,
    dead_time: float | None = None,
) -> Preview:
    """Feed-forward through inverse dynamics, sample by sample: weights of a window of references of which some lie ahead.

    target(k) = sum_j c_j r(k + ahead - j). Polynomials up to a degree are followed exactly; what freedom the window leaves
    minimises the error over the frequencies up to `band` (least squares). `error(f)` of the result tells what is left of a
    sine: with 4 ahead and the defaults 2e-11 at 20 Hz and 2e-7 at 100 Hz for 400 Hz, damping 0.95, at 10 kHz. The window must
    be as long as the inverse remembers: a few samples for resonances, some time constants of antiresonances.

    Parameters
    ----------
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or None
    dt : float
        Sampling interval in seconds.
    ahead : int
        How many samples ahead the newest reference is.
    window : int, optional
        How many references: by default as many before the moment that the target aims at as after it, and at least 4.
    degree : int, optional
        Of the polynomials that are followed exactly; by default 5, or what a window of less than 6 allows.
    band : float, optional
        Up to which frequency in Hz errors count; by default 0.4 / dt.
    amplifier_bandwidth : float, optional
        Cut-off frequency in Hz of an amplifier in series.
    dead_time : float, optional
        What the sensor shows later than the dynamics explain, in seconds.

    Returns
    -------
    Preview
        For a `HybridController`.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> made = mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
    >>> made
    <Preview of 8 taps, ahead 4>
    >>> made.error(20.0) < 1e-10, made.error(100.0) < 1e-6
    (True, True)
    """

def invert_dynamics(
    reference: ArrayLike | _Trajectory,
    dt: float,
    *,
    dynamics: _Dynamics | None = None,
    amplifier_bandwidth: float | None = None,
    dead_time: float | None = None,
    start: float | None = None,
    seconds: float | None = None,
) -> _Vector:
    """What must enter linear dynamics so that the position follows a reference: stable inversion over the whole record.

    Minimises sum (y - r)^2 and a small share of the second differences of the input, from rest, exactly sampled. So the input
    is bounded for any stable dynamics, also with zeros in the right half plane, and does not ring between samples. A
    reference that is in motion at its end is taken to go on.

    Parameters
    ----------
    reference : array of n floats, or one of `trajectories`
        The position that is read at t_k.
    dt : float
        Sampling interval in seconds.
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or None
    amplifier_bandwidth : float, optional
        Cut-off frequency in Hz of an amplifier in series.
    dead_time : float, optional
        What the sensor shows later than the dynamics explain, in seconds.
    start : float, optional
        The position at which the dynamics rest before; by default the first reference.
    seconds : float, optional
        How much of a trajectory object; by default one period, or until its end.

    Returns
    -------
    array of n floats

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> mode = mh.plant.SecondOrder(400.0, 0.95)
    >>> scan = mh.trajectories.Sine(3.3, 20.0)
    >>> held = mh.control.invert_dynamics(scan, 1e-4, dynamics=mode)
    >>> error = mode.response(held, 1e-4) - scan.sample(1e-4)[0]
    >>> bool(abs(error[100:]).max() < 1e-6)  # um, once the start is over
    True
    """

def precompensate(
    stage: Stage,
    reference: ArrayLike | _Trajectory,
    dt: float,
    *,
    limits: Sequence[float] | None = None,
    start: float | None = None,
    history: ArrayLike | None = None,
    lead_in: float | None = None,
) -> _Vector:
    """The drives that move a stage along a reference: `stage.precompensate(reference, dt, ...)`.

    Parameters
    ----------
    stage : Stage
    reference : array of n floats, or one of `trajectories`
    dt : float
        Sampling interval in seconds.
    limits, start, history, lead_in : optional
        As for `Stage.precompensate`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dynamics=mh.plant.SecondOrder(400.0, 0.95))
    >>> moves = mh.trajectories.PointToPoint([0.0, 2.0], velocity=200.0, acceleration=2e5, jerk=4e8)
    >>> drive = mh.control.precompensate(stage, moves, 1e-4)
    >>> bool(abs(stage.forward(1e-4).run(drive) - moves.sample(1e-4)[0]).max() < 2e-3)  # um
    True
    """

@final
class Margins:
    """How robust a loop is at one slope of the hysteresis.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95))
    >>> margins = stage.tune(dt=1e-4).at_max_slope
    >>> margins.phase_margin > 30.0, margins.peak_sensitivity <= 1.7  # degrees
    (True, True)
    """

    @property
    def slope(self) -> float:
        """The slope (um/V)."""
    @property
    def gain_margin(self) -> float:
        """The factor by which the gain may grow until the loop oscillates; infinite if it never does."""
    @property
    def phase_margin(self) -> float:
        """How many degrees the phase may lag more, the least over all frequencies with abs(L) = 1."""
    @property
    def crossover(self) -> float:
        """The highest frequency in Hz with abs(L) = 1."""
    @property
    def peak_sensitivity(self) -> float:
        """The peak of the sensitivity abs(1 / (1 + L))."""
    @property
    def peak_frequency(self) -> float:
        """Where that peak is, in Hz."""

@final
class Tuning:
    """Filters and gains of the feedback, and how robust the loop is with them: made by `tune`.

    Gains belong to their filters: without them a lightly damped stage may become unstable. `open_loop`, `sensitivity`,
    `complementary_sensitivity` and `worst_sensitivity` give the loop over frequency, `mpi_hyst.plot.tuning` draws it, and `explanation`
    says in words what was chosen and why.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95))
    >>> tuning = stage.tune(dt=1e-4)
    >>> tuning.ki > 0.0, tuning.peak_sensitivity <= 1.7
    (True, True)
    """

    @property
    def kp(self) -> float:
        """Proportional gain (V/um); negative for active damping."""
    @property
    def ki(self) -> float:
        """Integral gain (V/um/s)."""
    @property
    def filters(self) -> tuple[_Filter, ...]:
        """The filters before both gains: Notch, LowPass."""
    @property
    def structure(self) -> _Structure:
        """ "proportional-integral" without filters; "low-pass", which keeps the loop away from a resonance; "active damping", a low-pass
        behind which a negative kp damps; "notch", for those lightly damped modes that need one.
        """
    @property
    def rejection_bandwidth(self) -> float:
        """Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may be."""
    @property
    def noise_bandwidth(self) -> float:
        """The bandwidth in Hz of white noise of the sensor that the position follows, where the hysteresis has its greatest slope."""
    @property
    def tried(self) -> list[tuple[str, float]]:
        """What was tried, and roughly the ki of the best of its kind: why the structure was chosen. Empty without lightly damped modes."""
    @property
    def at_min_slope(self) -> Margins:
        """The margins where the hysteresis has its smallest slope, with the modes as they are known."""
    @property
    def at_max_slope(self) -> Margins:
        """The margins where it has its greatest slope."""
    @property
    def peak_sensitivity(self) -> float:
        """The peak of the sensitivity over all slopes between and all modes that may be."""
    @property
    def dt(self) -> float:
        """The sampling interval in seconds for which it is."""
    @property
    def peak_sensitivity_limit(self) -> float:
        """The peak of the sensitivity that was allowed."""
    @property
    def explanation(self) -> str:
        """In a few sentences: which structure was chosen and why, the bound on the sensitivity, crossover, margins and bandwidths."""
    def open_loop(self, frequencies: ArrayLike, slope: float | None = None) -> _Complex:
        """The open loop L(f) as complex numbers, with the modes as they are known.

        L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z) at z = exp(2 pi i f dt), with filters F and the sampled dynamics P, dead time included.

        Parameters
        ----------
        frequencies : array of n floats
            In Hz, above 0 and at most half of the sampling rate.
        slope : float, optional
            The slope of the hysteresis (um/V); by default the greatest, `at_max_slope.slope`.

        Returns
        -------
        array of n complex numbers

        Raises
        ------
        ValueError, TypeError
            That name the argument, what was expected and what came.

        Examples
        --------
        >>> import mpi_hyst as mh
        >>> tuning = mh.control.tune(mh.paper.plant("A1"))
        >>> round(float(abs(tuning.open_loop([tuning.at_max_slope.crossover])[0])), 9)
        1.0
        """
    def sensitivity(self, frequencies: ArrayLike, slope: float | None = None) -> _Complex:
        """The sensitivity S = 1 / (1 + L), what the loop leaves of a disturbance: arguments as for `open_loop`."""
    def complementary_sensitivity(
        self, frequencies: ArrayLike, slope: float | None = None
    ) -> _Complex:
        """The complementary sensitivity T = L / (1 + L), what the feedback follows of a reference and of noise: arguments as for
        `open_loop`.
        """
    def worst_sensitivity(self, frequencies: ArrayLike) -> _Vector:
        """The greatest abs(S) over all slopes of the hysteresis and all modes that may be: nowhere above `peak_sensitivity`.

        Frequencies are as for `open_loop`.
        """
    def plot(self, axes: Sequence[Axes] | None = None) -> Figure:
        """Draw it with `mpi_hyst.plot.tuning`, which has the arguments."""
    def _repr_html_(self) -> str: ...

def tune(
    stage: _Model | Stage | Plant,
    *,
    dt: float | None = None,
    peak_sensitivity: float = 1.7,
    dynamics: _Dynamics | None = None,
    amplifier_bandwidth: float | None = None,
    dead_time: float = 0.0,
    frequency_uncertainty: float | None = None,
    damping_uncertainty: float | None = None,
    structure: _Structure | None = None,
) -> Tuning:
    """Filters and gains of the proportional-integral feedback for a hysteresis with dynamics behind it.

    The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z): the positional law kp e + ki sum(e) behind filters F, the slope of the hysteresis,
    which lies between those of `model.slope_range`, and P the exact pulse transfer function of amplifier, dynamics and
    dead time for an input that is held from one measurement to the next. Of all gains with

    abs(1 / (1 + L)) <= peak_sensitivity at all frequencies and slopes, and the loop stable,

    those with the greatest ki are taken: a constant disturbance is removed with the integrated error 1 / ki (Åström,
    Panagopoulos and Hägglund, Automatica 34(5), 1998). Parts slower than 1e5 samples a radian and damping ratios below
    1e-7 are refused: their response does not show at the frequencies that are looked at.

    Without modes of a damping ratio below 0.5 there are no filters. With some, no filter, low-passes and notches are tried, each with the
    gains that suit it, and the bound holds for frequencies 5 % either way and for half to twice the damping, unless other
    uncertainties are given. Of those whose ki is within 5 % of the greatest the simplest is taken, unless a structure is given. Give a
    controller the filters with their gains.

    Parameters
    ----------
    stage : Stage, Plant, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        A model with the keywords `dynamics`, `amplifier_bandwidth` and `dead_time` makes a stage; a plant has one.
    dt : float
        Sampling interval in seconds; a plant has its own.
    dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
    amplifier_bandwidth : float, optional
        Cut-off frequency in Hz of an amplifier in series.
    dead_time : float, optional
        What the sensor shows later than the dynamics explain, in seconds, at most 1000 samples.
    peak_sensitivity : float
        1.05 to 5: 1.2 is cautious, 2 is bold. The gain may grow by M / (M - 1), the phase lag by 2 arcsin(1 / (2 M)).
    frequency_uncertainty : float, optional
        How far the frequencies of lightly damped modes may be from what is known: a share either way, 0 to 0.5, the same for all modes.
        By default 0.05, or three standard errors of the identification where they are more. (If one mode rises while its neighbour
        falls, the peak may be higher than is said.)
    damping_uncertainty : float, optional
        By which factor their damping may be less or more, 1 to 100, the same for all. By default 2, or what three standard errors make
        of it.
    structure : "proportional-integral", "low-pass", "active damping" or "notch", optional
        The only one that is admitted; all but the first need a lightly damped mode.

    Returns
    -------
    Tuning

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> tuning = mh.control.tune(mh.paper.table_1_recovered(), dt=1e-4, dynamics=mh.plant.SecondOrder(400.0, 0.95))
    >>> round(tuning.kp), round(tuning.ki, -3), round(tuning.peak_sensitivity, 3)
    (185, 358000.0, 1.7)
    >>> mh.control.tune(mh.paper.plant("A1")).kp == tuning.kp
    True
    >>> tuning.at_max_slope
    <Margins at slope 0.007919: gain margin 6.521, phase margin 47.1 degrees, crossover 408.658 Hz, peak sensitivity 1.700>
    >>> flexure = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
    >>> tuning = flexure.tune(1e-4)
    >>> tuning.structure, tuning.rejection_bandwidth > 80.0  # Hz; gains alone allow a few
    ('notch', True)
    >>> plain = flexure.tune(1e-4, structure="proportional-integral")
    >>> plain.filters, plain.rejection_bandwidth < 10.0
    ((), True)
    >>> flexure.tune(1e-4, frequency_uncertainty=0.01).ki > tuning.ki  # the mode is better known
    True
    """

@final
class LoopTimes:
    """Times of a loop in seconds: how late samples began, how long they took, or how far apart they began.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.paper.plant("A1").stage
    >>> plant = mh.plant.Plant(stage, dt=1e-3)
    >>> report = mh.realtime.run(stage, plant, [0.0, 0.5], rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.05)
    >>> report.latency.count > 0, report.latency.median <= report.latency.max  # s
    (True, True)
    """

    @property
    def count(self) -> int:
        """How many there were."""
    @property
    def median(self) -> float:
        """Half of them were at most so long."""
    @property
    def p99(self) -> float:
        """99 % of them were at most so long."""
    @property
    def p999(self) -> float:
        """99.9 % of them were at most so long."""
    @property
    def p9999(self) -> float:
        """99.99 % of them were at most so long."""
    @property
    def max(self) -> float:
        """The longest."""
    @property
    def histogram(self) -> list[tuple[float, int]]:
        """Pairs (upper end, count) of classes, each a quarter wider than the one before."""

@final
class LoopReport:
    """What a loop did, made by `run`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.paper.plant("A1").stage
    >>> plant = mh.plant.Plant(stage, dt=1e-3)
    >>> report = mh.realtime.run(stage, plant, [0.0, 0.5], rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.05)
    >>> report.end, report.at_rest
    ('time_over', True)
    """

    @property
    def end(
        self,
    ) -> Literal[
        "time_over",
        "reference_over",
        "requested",
        "watchdog",
        "deadline_missed",
        "panicked",
        "write_failed",
    ]:
        """Why it went to rest: "time_over", "reference_over", "requested", "watchdog", "deadline_missed", "panicked"; or why it ended where
        it was: "write_failed".
        """
    @property
    def at_rest(self) -> bool:
        """Whether the drive written last is the rest drive: False only if writing itself failed. Over UDP nobody confirms that it arrived: see
        `rest_refused`.
        """
    @property
    def rest_refused(self) -> int:
        """How often the other side of UDP said that nobody listens, since the last measurement came or since the rest drive was written first,
        whichever is longer ago. Above 0 the rest drive may have reached nobody, and one of the `warnings` says so. A computer that is off says
        nothing: 0 is no proof.
        """
    @property
    def last_drive(self) -> float:
        """The drive written last, V."""
    @property
    def last_fault(self) -> str | None:
        """The last fault of input or output in words, or None."""
    @property
    def seconds(self) -> float:
        """From the first deadline to the end."""
    @property
    def taken(self) -> int:
        """Samples that were taken. With `skipped` they are all deadlines there were."""
    @property
    def missed(self) -> int:
        """Of those, samples whose drive was written when the next one was due, or later: the missed deadlines."""
    @property
    def late(self) -> int:
        """Of those that were taken, samples that began only when the next one was due, or later: after a late wake-up, or to catch up."""
    @property
    def skipped(self) -> int:
        """Deadlines at which no sample was taken."""
    @property
    def stale(self) -> int:
        """Samples without a fresh enough measurement."""
    @property
    def latency(self) -> LoopTimes:
        """How late samples began."""
    @property
    def compute(self) -> LoopTimes:
        """How long samples took: reading, computing and writing."""
    @property
    def period(self) -> LoopTimes:
        """How far apart samples began."""
    @property
    def learning_phase(self) -> _LearningPhase | None:
        """Whether learning in the loop went on: "learning", "fading" or "stopped"; None without learning."""
    @property
    def divergence_count(self) -> int:
        """How often learning had diverged, and stopped, at the end. One of the `warnings` says so where it has not begun anew."""
    @property
    def warnings(self) -> list[str]:
        """What was refused, or failed without ending the loop."""
    def to_dict(self) -> dict[str, Any]:
        """Everything, also all counts, what was asked for, what of it was in force, and the machine, as plain values. "datagrams" has, over
        UDP, how many were received, lost, late, malformed and refused, else None.
        """
    def plot(self, axes: Sequence[Axes] | None = None) -> Figure:
        """Draw it with `mpi_hyst.plot.realtime`, which has the arguments."""
    def _repr_html_(self) -> str: ...

@final
class Functions:
    """Two functions of C: any driver of any vendor, through ctypes.

    `int read(void *context, double *measurement)` writes the measurement of now and returns 0; it returns a number above 0 if there is
    none that is newer, and one below 0 for a fault. `int write(void *context, double drive)` returns 0, or another number for a fault.
    Both are called once per sample from the thread of the loop, and must not wait. As with ctypes itself, a function of another
    signature crashes the process.

    This is for functions of a library. A function in Python that raises tells nobody: ctypes prints the exception and returns 0, so
    a drive that was never put out counts as written. Give `run` an object with `read` and `write` for Python: what that raises
    ends the loop, at rest if it can still be written to.

    Parameters
    ----------
    read, write : ctypes functions, or int
        Or their addresses.
    context : int
        An address that both get.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import ctypes
    >>> import mpi_hyst as mh
    >>> @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_double))
    ... def read(context, measurement):  # stands for a function of the driver's library
    ...     measurement[0] = 1.5
    ...     return 0
    >>> @ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double)
    ... def write(context, drive):
    ...     try:
    ...         pass  # the driver
    ...     except Exception:
    ...         return -1  # else ctypes returns 0, which is success
    ...     return 0
    >>> io = mh.realtime.Functions(read, write)
    """

    def __new__(cls, read: object, write: object, context: int = 0) -> Functions: ...
    def __deepcopy__(self, _memo: Any) -> Functions: ...

@final
class Udp:
    """A plant that talks in datagrams, on another computer or in another process.

    A datagram has 16 bytes, little-endian: a number that counts upwards (uint64), and a float64. The plant sends measurements to
    `local`, the loop drives to `plant`. The newest measurement counts. Lost ones are not fresh: the watchdog sees to it.
    A drive is written when the network has taken it: nobody confirms that it has arrived, also not the rest drive, which is sent 20 times.
    So the plant needs a watchdog of its own that goes to rest when no drives come. The report counts the datagrams:
    `LoopReport.to_dict()["datagrams"]`. It warns that the rest drive may have reached nobody, but only if the other computer says that nobody
    listens: `LoopReport.rest_refused`. One that is off says nothing.

    Parameters
    ----------
    plant, local : str
        "host:port".

    Raises
    ------
    ValueError
        That names the argument, for what is no host and port. What the network refuses is an OSError of `run`.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> io = mh.realtime.Udp("127.0.0.1:47001", local="127.0.0.1:47002")
    >>> io.plant
    '127.0.0.1:47001'
    """

    def __new__(cls, plant: str, *, local: str) -> Udp: ...
    def __getnewargs_ex__(self) -> tuple[tuple[str], dict[str, str]]: ...
    @property
    def plant(self) -> str:
        """Where drives go, and from where measurements are taken."""
    @property
    def local(self) -> str:
        """Where measurements come in."""

@final
class SharedMemory:
    """Memory that another process maps too.

    The loop makes a file of 256 bytes, in /dev/shm on Linux. The plant writes a measurement at offset 64, and reads the drive at
    offset 128. Each is a lock, a number and a float64, 8 bytes each. To write: make the lock odd, write a new number and the value, make
    the lock the next even number. To read: what was read is whole if the lock was even and is the same after it.

    While the loop runs it has an exclusive lock on the file (flock), so a second loop is refused. No other process may make the file
    shorter meanwhile: the system then ends the loop where it is (SIGBUS).

    Parameters
    ----------
    path : str or path-like
        The file: a new or empty one, or that of a loop that has ended. `run` refuses any other with OSError.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> io = mh.realtime.SharedMemory("/dev/shm/stage")
    >>> str(io.path)
    '/dev/shm/stage'
    """

    def __new__(cls, path: str | PathLike[str]) -> SharedMemory: ...
    @property
    def path(self) -> Path:
        """The file."""

@final
class Stop:
    """Asks a loop to go to rest and end, from any thread or handler of signals: given to `run` as `stop`.

    It cannot be taken back: a loop that is given a flag which was requested before goes to rest at once. Ctrl-C, and what else ends a
    loop from outside, requests it too.

    Examples
    --------
    >>> import mpi_hyst as mh, threading
    >>> stage = mh.paper.plant("A1").stage
    >>> plant = mh.plant.Plant(stage, dt=1e-3)
    >>> stop = mh.realtime.Stop()
    >>> button = threading.Timer(0.1, stop.request)
    >>> button.start()
    >>> report = mh.realtime.run(stage, plant, [1.0], rest_drive=0.0, rest_rate=5e3, rate=1000, stop=stop)
    >>> report.end, report.at_rest, stop.is_requested
    ('requested', True, True)
    """

    def __new__(cls) -> Stop: ...
    def request(self) -> None:
        """Asks for the end."""
    @property
    def is_requested(self) -> bool:
        """Whether somebody asked for the end."""
    def __deepcopy__(self, _memo: Any) -> Stop: ...

@type_check_only
class _Io(Protocol):
    def read(self) -> SupportsFloat | None: ...
    def write(self, drive: float, /) -> object: ...

def run(
    controller: HybridController | Stage,
    io: Plant | Functions | Udp | SharedMemory | _Io,
    reference: ArrayLike,
    *,
    rest_drive: float,
    rest_rate: float,
    rate: float | None = None,
    seconds: float | None = None,
    repeat: bool = True,
    misses: Literal["skip", "catch_up", "stop"] = "skip",
    most_caught_up: int = 100,
    watchdog: tuple[float, float] | None = (0.0, 0.1),
    most_write_faults: int = 100,
    spin: float = 0.0,
    cpu: int | None = None,
    fifo: int | None = None,
    lock_memory: bool = False,
    record: str | PathLike[str] | None = None,
    progress: Callable[[dict[str, Any]], object] | None = None,
    stop: Stop | None = None,
) -> LoopReport:
    """Runs the loop of a stage at a fixed rate, in a thread outside the interpreter.

    At every deadline the loop reads a measurement, computes a drive and writes it. It ends by a ramp to `rest_drive` at
    `rest_rate`, or at the slew if that is slower: after `seconds`, at the end of a reference that is not repeated, at
    Ctrl-C, when measurements are missing for too long, and when input or output raises. Ctrl-C ends the loop and not
    the program: the report says "requested". So does `stop`, from any thread. SIGTERM and SIGHUP end the loop, and then
    the program: where it has no handler of its own for them, and the main thread calls. Limits and slew hold all the
    time: in any time T the drive moves by at most slew (T + dt), counting writes that succeed. The drive written last
    is the rest drive, unless writing itself fails.

    A measurement that does not come is replaced by the last one for `stale_after` seconds. Then the controller is told
    that there is none, and holds the drive; if it is still coming back from the last loss, the last error stands in for up to
    `max_missing` samples first. After `rest_after` seconds without one the drive goes to rest. Of a sensor that is slower than the
    loop let `stale_after` be its interval.

    Parameters
    ----------
    controller : HybridController or Stage
        The amplifier must have its drive. It goes on from there, and is in its stop afterwards: `controller.hold = False` lets it run
        again. A stage makes one with the exact inverse, for `rate`.
    io : Plant, Functions, Udp, SharedMemory or object
        What is read from and written to. An object has `read()`, which returns a number or None if there is none that is newer, and
        `write(drive)`; its `limits` (low, high), if it states some, must hold those of the controller. Each call of it takes the interpreter: some ten microseconds, or as long as another thread of Python keeps it. What it
        raises is raised again when the loop has ended, with the LoopReport as its attribute `report`.
    reference : array of n floats
        Where the position should be, one for each sample.
    rest_drive : float
        The drive at which the loop ends, V.
    rest_rate : float
        How fast it goes there, V/s.
    rate : float, optional
        Samples per second, for a stage. A controller has its own.
    seconds : float, optional
        When it ends.
    repeat : bool
        Whether the reference is followed again and again.
    misses : "skip", "catch_up" or "stop"
        When a deadline is missed, go on with the next one that is still to come; take what is due without pause, at most
        `most_caught_up` samples, while the drive moves by what the slew gives for the time that goes by; or go to rest.
    most_caught_up : int
        What lies further back is skipped.
    watchdog : (stale_after, rest_after) or None
        In seconds. Without, the drive is held for ever.
    most_write_faults : int
        After so many writes in a row that failed the loop ends where it is.
    spin : float
        For how many seconds before each deadline the loop spins instead of sleeping: less latency for a busy processor.
    cpu : int, optional
        The processor on which the loop runs.
    fifo : int, optional
        The priority of SCHED_FIFO, 1 to 99.
    lock_memory : bool
        Whether all memory of the process stays in memory, until the loop has ended. Where the program had locked memory
        before, for ever. What is refused of these three is one of the `warnings` of the report.
    record : path-like, optional
        The file to which samples go: npy, with the fields time, reference, measurement, drive and lateness. It can be read at any moment, also
        if the process is killed. One that is there is replaced when the first samples are written.
    progress : callable, optional
        Called ten times per second with a dictionary: taken, missed, skipped, stale, measurement, drive, and `waiting`: for how many
        seconds no sample has been taken. While a read or a write does not return nothing can end the loop, and nothing moves the drive.
    stop : Stop, optional
        What others end the loop with, from any thread.

    Returns
    -------
    LoopReport

    Raises
    ------
    ValueError, TypeError, OSError
        That name the argument, what was expected and what came. Nothing was written then.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.paper.plant("A1").stage
    >>> reference = mh.signals.sine(2.0, 10.0, seconds=0.1, rate=1000)  # um
    >>> plant = mh.plant.Plant(stage, dt=1e-3)
    >>> report = mh.realtime.run(stage, plant, reference, rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.3)
    >>> report.end, report.at_rest, plant.drive
    ('time_over', True, 0.0)
    """
