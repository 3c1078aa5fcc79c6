"""Types of the engine. Private: use `import surefix`."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, overload

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Times = npt.NDArray[np.int64]

__version__: str
STATUS_NAMES: tuple[str, ...]
MAX_SECONDS: float
MAX_LATENCY: float
MAX_MODEL_STATES: int
MAX_SENSORS: int
SIGMA_FACTORS: tuple[float, float]

@overload
def normal_two_sided(risk: float) -> float: ...
@overload
def normal_two_sided(risk: npt.ArrayLike) -> _Floats: ...
def noncentral_chi_squared_tail(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Any: ...
def noncentral_chi_squared_cdf(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Any: ...
def noncentral_chi_squared_density(
    x: npt.ArrayLike, degrees: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> Any: ...
def noncentrality_for(missed: npt.ArrayLike, x: npt.ArrayLike, degrees: npt.ArrayLike) -> Any: ...
def chi_squared_tail(x: npt.ArrayLike, degrees: npt.ArrayLike) -> _Floats: ...
def chi_squared_threshold(probability: npt.ArrayLike, degrees: npt.ArrayLike) -> _Floats: ...

class Model:
    @staticmethod
    def chain(integrators: int, position: bool, root_density: float) -> Model: ...
    @staticmethod
    def linear(A: npt.ArrayLike, W: npt.ArrayLike) -> Model: ...
    @staticmethod
    def discrete(F: npt.ArrayLike, Q: npt.ArrayLike, period: int) -> Model: ...
    @property
    def size(self) -> int: ...
    def transition(self, elapsed: int) -> tuple[str, _Floats | None, _Floats | None]: ...

class System:
    def __init__(
        self,
        model: Model,
        observes: npt.ArrayLike,
        sigma: npt.ArrayLike,
        latency: npt.ArrayLike,
        scale_sigma: npt.ArrayLike,
        scale_time: npt.ArrayLike,
        bias_sigma: npt.ArrayLike,
        bias_time: npt.ArrayLike,
    ) -> None: ...
    @property
    def size(self) -> int: ...
    @property
    def sensor_count(self) -> int: ...
    def scale_state(self, sensor: int) -> int: ...
    def bias_state(self, sensor: int) -> int: ...
    def transition(self, elapsed: int) -> tuple[str, _Floats | None, _Floats | None]: ...
    def row(self, sensor: int, x: npt.ArrayLike) -> tuple[_Floats, float]: ...

class FilterEngine:
    def __init__(
        self, system: System, x: npt.ArrayLike, P: npt.ArrayLike, start: int | None, capacity: int
    ) -> None: ...
    def with_system(self, system: System, old_index: Sequence[int]) -> FilterEngine: ...
    def push(self, stamp: int, sensor: int, value: float, id: int, factor: float) -> int: ...
    def estimate(self, time: int) -> tuple[str, _Floats, _Floats, float, int]: ...
    def noise(self) -> tuple[_Times, _Floats, _Floats]: ...
    @property
    def counters(self) -> tuple[int, ...]: ...
    @property
    def log_likelihood(self) -> float: ...
    @property
    def waiting(self) -> int: ...
    def run(
        self,
        stamp: _Times,
        sensor: npt.NDArray[np.int32],
        value: _Floats,
        factor: _Floats | None,
        times: _Times | None,
        noise_scope: int,
        delay: int | None,
    ) -> tuple[
        _Floats, _Floats, _Floats, _Floats, npt.NDArray[np.int32], npt.NDArray[np.uint8],
        _Floats, _Floats, float, str, int,
    ]: ...  # fmt: skip
    def save(self) -> dict[str, Any]: ...
    def restore(self, saved: dict[str, Any]) -> str: ...

class CompositeEngine:
    def __init__(
        self,
        F: Sequence[npt.ArrayLike],
        Q: Sequence[npt.ArrayLike],
        G: Sequence[npt.ArrayLike],
        H: Sequence[npt.ArrayLike],
        R: Sequence[npt.ArrayLike],
        J: Sequence[npt.ArrayLike],
        Upsilon: npt.ArrayLike | None,
    ) -> None: ...
    @property
    def separable(self) -> bool: ...
    def matrices(self) -> dict[str, _Floats]: ...
    def backward(self) -> dict[str, _Floats] | None: ...
    def Gamma(self, P: npt.ArrayLike) -> _Floats: ...
    def update(
        self,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        z: npt.ArrayLike,
        u: npt.ArrayLike,
        sequential: bool,
    ) -> dict[str, Any]: ...

MAX_MODES: int
MAX_HYPOTHESES: int
MAX_MEASUREMENTS: int
LARGEST_VALUE: float

def alert_limits(
    weight: npt.ArrayLike, mean: npt.ArrayLike, sigma: npt.ArrayLike, risk: float, sides: int
) -> tuple[float, float]: ...
def per_estimate(risk: float, exposures: float) -> float: ...

class RobustEngine:
    def __init__(
        self,
        system: System,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        modes: Sequence[Sequence[tuple[float, ...]]],
        max_faults: int,
        prior: int,
        joint_rates: Sequence[float],
        carry: int,
        components: int,
        cut: float,
        memory: float,
        direction: Sequence[float],
        risk: float,
        sides: int,
        tree: int,
        start: int | None,
        capacity: int,
    ) -> None: ...
    def push(self, stamp: int, sensor: int, value: float, id: int, factor: float) -> int: ...
    def estimate(self, time: int) -> dict[str, Any]: ...
    @property
    def counters(self) -> tuple[int, ...]: ...
    @property
    def log_likelihood(self) -> float: ...
    @property
    def waiting(self) -> int: ...
    def hypotheses(self) -> dict[str, Any]: ...
    def run(
        self,
        stamp: _Times,
        sensor: npt.NDArray[np.int32],
        value: _Floats,
        factor: _Floats | None,
        times: _Times | None,
        delay: int | None,
        per_measurement: bool,
        noise: bool,
    ) -> dict[str, Any]: ...
    def save(self) -> dict[str, Any]: ...
    def restore(self, saved: dict[str, Any]) -> str: ...

MAX_LINEAR_SIZE: int

class LinearSystemEngine:
    def __init__(
        self,
        A: npt.ArrayLike,
        Q: npt.ArrayLike,
        H: npt.ArrayLike,
        R: npt.ArrayLike,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
    ) -> None: ...

class StateMap:
    def __init__(
        self, states: Sequence[Sequence[int]], mean: Sequence[float], variance: Sequence[float]
    ) -> None: ...

_Problem: TypeAlias = tuple[str, int, int, float]

class ModeChainEngine:
    @staticmethod
    def make(
        modes: Sequence[tuple[float, float]],
        transition: npt.ArrayLike,
        initial: npt.ArrayLike | None,
    ) -> ModeChainEngine | _Problem: ...
    @staticmethod
    def restore(
        gamma: Sequence[float],
        branches: Sequence[Sequence[tuple[float, float]]],
        transition: npt.ArrayLike,
        initial: npt.ArrayLike,
    ) -> ModeChainEngine: ...
    @staticmethod
    def independent(
        gamma: Sequence[float],
        gamma_transition: npt.ArrayLike,
        delta: Sequence[float],
        delta_transition: npt.ArrayLike,
    ) -> ModeChainEngine | _Problem: ...
    def lumped(
        self, groups: Sequence[Sequence[int]], law: npt.ArrayLike
    ) -> ModeChainEngine | _Problem: ...
    @property
    def gamma(self) -> list[float]: ...
    @property
    def branches(self) -> list[list[tuple[float, float]]]: ...
    @property
    def transition(self) -> _Floats: ...
    @property
    def initial(self) -> _Floats: ...

def check_transition(P: npt.ArrayLike) -> _Floats | _Problem: ...
def stationary(P: npt.ArrayLike) -> _Floats | None: ...
def transition_over(rates: npt.ArrayLike, dt: float) -> _Floats | str: ...
def check_linear(
    chain: ModeChainEngine, p: npt.ArrayLike, steps: int
) -> tuple[bool, float, float, float, float, int]: ...

class SwitchingEngine:
    @staticmethod
    def one_step(
        system: LinearSystemEngine, chain: ModeChainEngine, p: npt.ArrayLike
    ) -> SwitchingEngine | str: ...
    @staticmethod
    def imm(
        systems: Sequence[LinearSystemEngine],
        chain: ModeChainEngine,
        p: npt.ArrayLike,
        map: StateMap | None,
    ) -> SwitchingEngine | str: ...
    @staticmethod
    def genie(
        system: LinearSystemEngine, modes: Sequence[tuple[float, float]]
    ) -> SwitchingEngine | str: ...
    def run(
        self, z: _Floats, modes: npt.NDArray[np.int32] | None, n: int, M: int, threads: int
    ) -> tuple[_Floats, _Floats, _Floats, _Floats, str, int, int]: ...

class LinearFilterEngine:
    @staticmethod
    def make(
        system: LinearSystemEngine,
        chain: ModeChainEngine,
        p: npt.ArrayLike,
        nominal: npt.ArrayLike | None,
    ) -> LinearFilterEngine | str: ...
    def run(
        self, z: _Floats, modes: npt.NDArray[np.int32] | None, n: int, M: int, threads: int
    ) -> tuple[_Floats, _Floats, _Floats, _Floats, str, int, int]: ...

DETECTABLE: float
MAX_PROFILE_STATES: int

class DriftProfile:
    def __init__(self, A: npt.ArrayLike, output: npt.ArrayLike, onset: npt.ArrayLike) -> None: ...
    @staticmethod
    def pulse() -> DriftProfile: ...
    def states(self, elapsed: npt.ArrayLike) -> _Floats: ...

class DriftRecord:
    @staticmethod
    def of_system(
        system: LinearSystemEngine,
        z: npt.ArrayLike,
        inputs: npt.ArrayLike | None,
        times: npt.ArrayLike,
        estimates: bool,
    ) -> tuple[DriftRecord, _Floats, _Floats] | str: ...
    @staticmethod
    def of_log(
        system: System,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        start: int | None,
        stamp: _Times,
        sensor: npt.NDArray[np.int32],
        value: _Floats,
        factor: _Floats | None,
    ) -> tuple[DriftRecord, npt.NDArray[np.uint8]]: ...
    @property
    def size(self) -> int: ...
    @property
    def mixed(self) -> bool: ...
    @property
    def innovations(self) -> _Floats: ...
    @property
    def log_likelihood(self) -> _Floats: ...
    @property
    def ids(self) -> npt.NDArray[np.int64]: ...
    @property
    def inverse(self) -> _Floats: ...
    @property
    def noise(self) -> _Floats: ...
    def weights(self, direction: npt.ArrayLike) -> _Floats: ...
    def whiten(self, innovations: npt.ArrayLike, threads: int) -> _Floats: ...
    def precision(self) -> _Floats: ...
    def onsets(
        self, profile: DriftProfile, direction: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.int64], _Floats, _Floats] | None: ...
    def scan(
        self,
        profile: DriftProfile,
        direction: npt.ArrayLike,
        innovations: npt.ArrayLike,
        onsets: int,
        threads: int,
    ) -> _Floats | None: ...
    def response(
        self, profile: DriftProfile, direction: npt.ArrayLike, measurement: int
    ) -> _Floats | None: ...
    def spectrum(
        self,
        direction: npt.ArrayLike,
        omega: npt.ArrayLike,
        innovations: npt.ArrayLike,
        threads: int,
    ) -> tuple[_Floats, _Floats, _Floats]: ...
    def wave(self, direction: npt.ArrayLike, omega: float) -> _Floats: ...

class GradientEngine:
    def __init__(self, system: LinearSystemEngine) -> None: ...
    def run(self, z: object, inputs: object) -> _Floats | None: ...

MAX_SEARCHES: int

class SlidingEngine:
    def __init__(
        self,
        system: System,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        start: int | None,
        capacity: int,
        window: int,
    ) -> None: ...
    def add(self, profile: DriftProfile, direction: npt.ArrayLike, false_alarm: float) -> str: ...
    def push(self, stamp: int, sensor: int, value: float, id: int, factor: float) -> int: ...
    def estimate(self, time: int) -> tuple[str, _Floats, _Floats]: ...
    def look(self, search: int) -> tuple[str, int, float, float, _Floats, _Floats, int]: ...
    def clear(self) -> None: ...
    @property
    def size(self) -> int: ...

RAIM_STATUS_NAMES: tuple[str, ...]
DECLARED_NAMES: tuple[str, ...]
MAX_SATELLITES: int
MAX_SATELLITE_SYSTEMS: int
MAX_EXCLUDED: int
EARTH_ROTATION: float

def least_power(
    noncentrality: npt.ArrayLike,
    bound: npt.ArrayLike,
    degrees: npt.ArrayLike,
    threshold: npt.ArrayLike,
) -> Any: ...
def most_power(
    noncentrality: npt.ArrayLike,
    bound: npt.ArrayLike,
    degrees: npt.ArrayLike,
    threshold: npt.ArrayLike,
) -> Any: ...
def power_loss(
    noncentrality: npt.ArrayLike,
    bound: npt.ArrayLike,
    degrees: npt.ArrayLike,
    threshold: npt.ArrayLike,
) -> Any: ...
def power_gain(
    noncentrality: npt.ArrayLike,
    bound: npt.ArrayLike,
    degrees: npt.ArrayLike,
    threshold: npt.ArrayLike,
) -> Any: ...
def worst_power_loss(
    bound: npt.ArrayLike, degrees: npt.ArrayLike, threshold: npt.ArrayLike
) -> Any: ...
def worst_power_gain(
    bound: npt.ArrayLike, degrees: npt.ArrayLike, threshold: npt.ArrayLike
) -> Any: ...

class LinearTestEngine:
    def __init__(self, H: npt.ArrayLike, M: npt.ArrayLike, L: npt.ArrayLike) -> None: ...
    @property
    def W(self) -> _Floats: ...
    @property
    def whitening(self) -> _Floats: ...
    @property
    def rank(self) -> int: ...
    @property
    def degrees(self) -> int: ...
    def statistic(self, Y: npt.ArrayLike) -> _Floats: ...
    def parity(self, Y: npt.ArrayLike) -> _Floats: ...

def affine_fit(
    X: npt.ArrayLike, values: npt.ArrayLike, minimax: bool
) -> tuple[_Floats, _Floats, _Floats]: ...

class TrackEngine:
    def __init__(
        self, points: npt.ArrayLike, mileage: npt.ArrayLike | None, tolerance: float, start: float
    ) -> None: ...
    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def error(self) -> float: ...
    @property
    def edge_error(self) -> float: ...
    def at(self, along: npt.ArrayLike) -> tuple[_Floats, _Floats, _Floats]: ...
    def bend_bound(self, low: float, high: float) -> float: ...
    def curvature_bound(self, low: float, high: float) -> float: ...
    def nearest(self, positions: npt.ArrayLike) -> _Floats: ...

class TrackRaimEngine:
    def __init__(
        self,
        track: TrackEngine,
        length: float,
        false_alarm: float,
        missed: float,
        risk: float,
        fault_probability: float,
        max_faults: int,
        max_excluded: int,
        interval: float,
        rotation: float,
    ) -> None: ...
    def judge(
        self,
        time: npt.ArrayLike,
        begin: npt.ArrayLike,
        position: npt.ArrayLike,
        pseudorange: npt.ArrayLike,
        sigma: npt.ArrayLike,
        system: npt.ArrayLike,
        max_speed: float,
        near: float,
        progress: Callable[[int, int], None],
    ) -> dict[str, Any]: ...
