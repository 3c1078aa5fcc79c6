"""Simulate the demo journey of a train and the log of its three speed sensors.

Run ``python examples/demo/make_log.py`` to rewrite, byte for byte, the files that ship inside the
package, in ``python/surefix/data/demo``:

* ``log.csv``      what the sensors delivered, one row per measurement, in order of arrival
* ``truth.csv``    the true speed and acceleration, 5 Hz
* ``events.csv``   the faults that were injected, dated by the arrival of what they spoilt
* ``config.toml``  how to fuse the log

Units are SI throughout: s, m/s, m/s² and m/s³. Only NumPy is needed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SEED = 2004
DURATION_S = 720.0
TRUTH_RATE_HZ = 5.0
DEFAULT_OUTPUT = Path(__file__).resolve().parents[2] / "python" / "surefix" / "data" / "demo"


# --- The journey ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class SpeedChange:
    """A smooth change of speed; changes that overlap in time add up."""

    start_s: float
    change_mps: float
    acceleration_mps2: float  # magnitude on the plateau


# The acceleration of every change takes this long to build up and to die out.
RAMP_S = 4.0

JOURNEY = (
    # Departure at 25 s, to 30 m/s. Two changes at once: traction fades as the speed grows.
    SpeedChange(25.0, +8.0, 0.35),
    SpeedChange(25.0, +22.0, 0.40),
    # Cruise over gentle gradients.
    SpeedChange(92.0, -2.0, 0.16),
    SpeedChange(112.0, +3.0, 0.20),
    SpeedChange(136.0, -1.0, 0.10),
    # Brake to 18 m/s for a curve, then accelerate to 44 m/s.
    SpeedChange(155.0, -12.0, 0.55),
    SpeedChange(200.0, +8.0, 0.25),
    SpeedChange(200.0, +18.0, 0.36),
    # Slow down to 33 m/s inside the tunnel.
    SpeedChange(285.0, -11.0, 0.58),
    # Intermediate stop, from 394 s to 425 s.
    SpeedChange(340.0, -33.0, 0.66),
    # Departure on wet rail, gently, to the line speed of 38 m/s and its gradients.
    SpeedChange(425.0, +8.0, 0.20),
    SpeedChange(425.0, +30.0, 0.36),
    SpeedChange(530.0, -3.0, 0.15),
    SpeedChange(560.0, +2.0, 0.12),
    # Final stop at 689 s.
    SpeedChange(625.0, -37.0, 0.62),
)

# What the journey must keep to, the wander included.
MAX_ACCELERATION_MPS2 = 0.9
MAX_BRAKING_MPS2 = 0.8
MAX_JERK_MPS3 = 0.5

# The wander: a sum of sines of these periods with random phases, which sum to this acceleration.
WANDER_PERIODS_S = np.geomspace(4.0, 60.0, 24)
WANDER_RMS_MPS2 = 0.04
# It fades in with the speed, for a standing train does not wander.
WANDER_FULL_SPEED_MPS = 10.0


def smoothstep(x: Array) -> Array:
    """Rise from 0 at x <= 0 to 1 at x >= 1, with a continuous derivative."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def smoothstep_derivative(x: Array) -> Array:
    """Differentiate `smoothstep`."""
    u = np.clip(x, 0.0, 1.0)
    return 6.0 * u * (1.0 - u)


def smoothstep_integral(x: Array) -> Array:
    """Integrate `smoothstep` from 0 to x."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * u * (1.0 - 0.5 * u) + np.maximum(x - 1.0, 0.0)


class Profile:
    """The true motion in closed form, so that every sensor can sample it at any instant."""

    def __init__(self, changes: Sequence[SpeedChange], rng: np.random.RandomState) -> None:
        """Plan the changes of speed and draw the wander."""
        self._changes = tuple(changes)
        self._pulsations = 2.0 * np.pi / WANDER_PERIODS_S
        self._phases = rng.uniform(0.0, 2.0 * np.pi, WANDER_PERIODS_S.size)
        self._amplitude_mps2 = WANDER_RMS_MPS2 * np.sqrt(2.0 / WANDER_PERIODS_S.size)

    def _planned(self, times_s: Array) -> tuple[Array, Array]:
        """Return the speed and the acceleration without the wander."""
        speed = np.zeros_like(times_s)
        acceleration = np.zeros_like(times_s)
        for change in self._changes:
            sign = np.sign(change.change_mps)
            plateau = sign * change.acceleration_mps2
            # The ramp down is the ramp up, this much later.
            length = abs(change.change_mps) / change.acceleration_mps2
            up = (times_s - change.start_s) / RAMP_S
            down = (times_s - change.start_s - length) / RAMP_S
            speed += plateau * RAMP_S * (smoothstep_integral(up) - smoothstep_integral(down))
            acceleration += plateau * (smoothstep(up) - smoothstep(down))
        # The sum of the changes at a stop is zero but for its rounding, which may be negative.
        return np.where(speed < 1e-9, 0.0, speed), acceleration

    def _wander(self, times_s: Array) -> tuple[Array, Array]:
        """Return the wander of the speed and of the acceleration, at full strength."""
        angles = np.multiply.outer(times_s, self._pulsations) + self._phases
        acceleration = self._amplitude_mps2 * np.cos(angles).sum(axis=-1)
        speed = self._amplitude_mps2 * (np.sin(angles) / self._pulsations).sum(axis=-1)
        return speed, acceleration

    def motion(self, times_s: Array) -> tuple[Array, Array]:
        """Return the true speed (m/s) and its exact derivative, the acceleration (m/s²)."""
        speed, acceleration = self._planned(times_s)
        wander_speed, wander_acceleration = self._wander(times_s)
        x = speed / WANDER_FULL_SPEED_MPS
        strength = smoothstep(x)
        strength_rate = smoothstep_derivative(x) * acceleration / WANDER_FULL_SPEED_MPS
        return (
            speed + strength * wander_speed,
            acceleration + strength * wander_acceleration + strength_rate * wander_speed,
        )

    def speed(self, times_s: Array) -> Array:
        """Return the true speed (m/s)."""
        return self.motion(times_s)[0]


def check_profile(profile: Profile) -> None:
    """Refuse a journey that no train could make."""
    step_s = 0.005
    times_s = np.arange(0.0, DURATION_S, step_s)
    speed, acceleration = profile.motion(times_s)
    jerk = np.diff(acceleration) / step_s
    if speed.min() < 0.0:
        raise ValueError(f"the speed falls to {speed.min():.3f} m/s")
    if acceleration.max() > MAX_ACCELERATION_MPS2 or acceleration.min() < -MAX_BRAKING_MPS2:
        raise ValueError(
            f"the acceleration spans {acceleration.min():.3f} to {acceleration.max():.3f} m/s²"
        )
    if np.abs(jerk).max() > MAX_JERK_MPS3:
        raise ValueError(f"the jerk reaches {np.abs(jerk).max():.3f} m/s³")


# --- The sensors ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sensor:
    """A speed sensor: white Gaussian noise, and a period that jitters."""

    name: str
    sigma_mps: float
    rate_hz: float
    latency_s: float = 0.0  # from the instant that was measured to the delivery
    miss_probability: float = 0.0  # of each single epoch


WHEEL = Sensor("wheel", sigma_mps=1.0, rate_hz=20.0)
RADAR = Sensor("radar", sigma_mps=2.0, rate_hz=10.0)
GPS = Sensor("gps", sigma_mps=0.5, rate_hz=5.0, latency_s=0.15, miss_probability=0.015)
SENSORS = (WHEEL, RADAR, GPS)

# Every interval between two epochs is drawn within this fraction of the period.
JITTER = 0.2

# Times are written with 4 decimals; they are rounded before the truth is sampled, so that what
# the log says of a time is exact.
TIME_DECIMALS = 4


@dataclass
class Readings:
    """What one sensor delivered."""

    times_s: Array
    values_mps: Array


def delivery_times(sensor: Sensor, rng: np.random.RandomState) -> Array:
    """Draw when the measurements of a sensor arrive."""
    period = 1.0 / sensor.rate_hz
    # Enough intervals to cover the journey even if all of them were the shortest.
    count = int(DURATION_S / (period * (1.0 - JITTER))) + 1
    intervals = period * rng.uniform(1.0 - JITTER, 1.0 + JITTER, count)
    intervals[0] = period * rng.uniform(0.0, 1.0)
    times = np.round(np.cumsum(intervals) + sensor.latency_s, TIME_DECIMALS)
    heard = rng.uniform(0.0, 1.0, count) >= sensor.miss_probability
    kept: Array = times[heard & (times <= DURATION_S)]
    return kept


def measure(sensor: Sensor, profile: Profile, rng: np.random.RandomState) -> Readings:
    """Simulate a sensor that works."""
    times_s = delivery_times(sensor, rng)
    noise = sensor.sigma_mps * rng.standard_normal(times_s.size)
    return Readings(times_s, profile.speed(times_s - sensor.latency_s) + noise)


# --- The faults ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Event:
    """A fault as `events.csv` tells it."""

    start_s: float
    end_s: float
    sensor: Sensor
    kind: str
    description: str


TUNNEL = Event(270.0, 330.0, GPS, "frozen", "tunnel: gps repeats its last speed")
DROPOUT = Event(545.0, 549.0, RADAR, "dropout", "radar delivers nothing")
SLIP = Event(431.0, 439.0, WHEEL, "slip", "wet departure: wheel reads up to 6 m/s fast")
SLIDE = Event(668.0, 671.0, WHEEL, "slide", "last braking: wheel reads 4 m/s slow")
SLIP_MPS = 6.0
SLIP_RAMP_S = 3.0
SLIDE_MPS = -4.0
SLIDE_RAMP_S = 0.5

# Isolated outliers: near this time (s), this sensor reads this speed (m/s) just once.
OUTLIERS = (
    (14.0, RADAR, 17.2),
    (61.5, RADAR, 44.9),
    (101.0, WHEEL, 12.4),
    (124.3, RADAR, 3.1),
    (172.0, RADAR, 0.0),
    (190.7, GPS, 31.8),
    (233.0, RADAR, 6.3),
    (312.4, RADAR, 52.6),
    (409.0, RADAR, 28.6),  # 103 km/h, while the train stands
    (487.6, RADAR, 13.8),
    (520.2, WHEEL, 21.5),
    (648.8, RADAR, 61.0),
)
OUTLIER_RANGE_MPS = (10.0, 40.0)


def freeze(readings: Readings, event: Event) -> None:
    """Repeat the last value before the event throughout it."""
    frozen = (readings.times_s >= event.start_s) & (readings.times_s < event.end_s)
    last = int(np.flatnonzero(readings.times_s < event.start_s)[-1])
    readings.values_mps[frozen] = readings.values_mps[last]


def drop(readings: Readings, event: Event) -> None:
    """Remove what would have been delivered during the event."""
    kept = (readings.times_s < event.start_s) | (readings.times_s >= event.end_s)
    readings.times_s = readings.times_s[kept]
    readings.values_mps = readings.values_mps[kept]


def deviate(readings: Readings, event: Event, peak_mps: float, ramp_s: float) -> None:
    """Add a deviation that rises and falls smoothly within the event."""
    rise = smoothstep((readings.times_s - event.start_s) / ramp_s)
    fall = smoothstep((event.end_s - readings.times_s) / ramp_s)
    readings.values_mps += peak_mps * rise * fall


def strike(
    readings: Readings, profile: Profile, sensor: Sensor, near_s: float, value: float
) -> Event:
    """Replace the one reading nearest to a time by an outlier."""
    index = int(np.argmin(np.abs(readings.times_s - near_s)))
    time_s = float(readings.times_s[index])
    error = value - float(profile.speed(np.array([time_s - sensor.latency_s]))[0])
    low, high = OUTLIER_RANGE_MPS
    if not low <= abs(error) <= high:
        raise ValueError(f"the outlier at {time_s} s is off by {error:.1f} m/s")
    readings.values_mps[index] = value
    return Event(time_s, time_s, sensor, "outlier", f"single reading off by {error:+.1f} m/s")


def inject_faults(log: dict[str, Readings], profile: Profile) -> list[Event]:
    """Spoil the readings in place and tell how, in order of time."""
    freeze(log[GPS.name], TUNNEL)
    drop(log[RADAR.name], DROPOUT)
    deviate(log[WHEEL.name], SLIP, SLIP_MPS, SLIP_RAMP_S)
    deviate(log[WHEEL.name], SLIDE, SLIDE_MPS, SLIDE_RAMP_S)
    outliers = [
        strike(log[sensor.name], profile, sensor, near_s, value)
        for near_s, sensor, value in OUTLIERS
    ]
    return sorted([TUNNEL, DROPOUT, SLIP, SLIDE, *outliers], key=lambda event: event.start_s)


# --- The files -----------------------------------------------------------------------------------


def write(path: Path, text: str) -> None:
    """Write a text file that is the same on every system."""
    path.write_bytes(text.encode("utf-8"))


def table(lines: Sequence[str]) -> str:
    """End every line of a CSV file."""
    return "\n".join(lines) + "\n"


def fixed(value: float, decimals: int) -> str:
    """Format a number; what rounds to zero has no sign."""
    return f"{round(float(value), decimals) + 0.0:.{decimals}f}"


def log_lines(log: dict[str, Readings]) -> list[str]:
    """Merge the sensors in order of arrival."""
    rows = [
        (float(time_s), name, float(value))
        for name, readings in log.items()
        for time_s, value in zip(readings.times_s, readings.values_mps, strict=True)
    ]
    rows.sort(key=lambda row: row[0])
    body = [f"{fixed(t, TIME_DECIMALS)},{name},{fixed(value, 3)}" for t, name, value in rows]
    return ["time_s,sensor,value", *body]


def truth_lines(profile: Profile) -> list[str]:
    """Tabulate the true motion."""
    times_s = np.arange(int(DURATION_S * TRUTH_RATE_HZ) + 1) / TRUTH_RATE_HZ
    body = [
        f"{fixed(t, TIME_DECIMALS)},{fixed(v, 4)},{fixed(a, 4)}"
        for t, v, a in zip(times_s, *profile.motion(times_s), strict=True)
    ]
    return ["time_s,speed_mps,acceleration_mps2", *body]


def event_lines(events: Sequence[Event]) -> list[str]:
    """Tabulate the faults."""
    body = [
        f"{fixed(event.start_s, TIME_DECIMALS)},{fixed(event.end_s, TIME_DECIMALS)},"
        f"{event.sensor.name},{event.kind},{event.description}"
        for event in events
    ]
    return ["start_s,end_s,sensor,kind,description", *body]


CONFIG_HEAD = """\
# How to fuse log.csv, the log of the demo. Units: m/s, m/s², s.

[model]
kind = "constant-acceleration"
# Root spectral density of the jerk, m/s³/√Hz. On the average this journey needs the 0.08 of the
# paper: over 4 s the acceleration changes by 0.16 m/s² rms, which is 0.08 √4. But the changes
# gather in ramps of 4 s, where the jerk peaks at 0.28 m/s³ and the estimate of the speed lags: by
# at most 2.5 sigma with 0.08 and by 1.7 sigma with 0.12, for a sigma 12 % larger. A bound that must
# hold during the ramps too wants the lag well below 2 sigma.
jerk = 0.12

[initial]
# The train stands: speed (m/s) and acceleration (m/s²).
state = [0.0, 0.0]
sigma = [1.0, 0.1]
"""

CONFIG_FAULTS = """
# The faults of every sensor: any of its modes begins about once in 100 s, more often than in this
# log, for a fault that is held to be too rare makes limits too narrow. Durations are orders of
# magnitude: a reading or a few, a slip, a tunnel. A sensor that drifts is off by some 10 m/s, which
# wander by 1 m/s in a second. A reading can be anywhere in a span of 100 m/s, and the log has three
# decimals: a GPS that is frozen repeats them. Half or twice these numbers serve as well.
"""

CONFIG_TAIL = """
[robust]
components = 36      # one for each combination of modes; more are slower and a little wider

[output]
rate = 5.0           # Hz
risk = 1e-11         # that the true speed lies outside the limits, per estimate
false_alarm = 0.01   # that any row of a healthy run is flagged, by the linear filter

[reference]
file = "truth.csv"
time = "time_s"
value = "speed_mps"
"""

OUTAGE = 'mode = "outage", span = 100.0, rate = 0.01, duration = 1.0'
DRIFTING = 'mode = "drifting", sigma = 10.0, walk = 1.0, rate = 0.01, duration = 5.0'
FROZEN = 'mode = "frozen", resolution = 0.001, span = 100.0, rate = 0.01, duration = 30.0'
MODES = {
    "wheel": (OUTAGE, DRIFTING),
    "radar": (OUTAGE, DRIFTING),
    "gps": (OUTAGE, FROZEN, DRIFTING),
}


def config_text() -> str:
    """Describe the sensors as they were simulated, and what can be wrong with them."""
    tables = []
    for sensor in SENSORS:
        lines = ["", "[[sensor]]", f'name = "{sensor.name}"', f"sigma = {sensor.sigma_mps}"]
        if sensor.latency_s > 0.0:
            lines.append(f"latency = {sensor.latency_s}")
        lines += ["faults = [", *(f"  {{ {mode} }}," for mode in MODES[sensor.name]), "]"]
        tables.append("\n".join(lines) + "\n")
    return CONFIG_HEAD + CONFIG_FAULTS + "".join(tables) + CONFIG_TAIL


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(description="Simulate the log of the demo.")
    parser.add_argument("--output", type=Path, default=DEFAULT_OUTPUT, help="folder to write to")
    output: Path = parser.parse_args(arguments).output

    # RandomState, for NumPy promises that its streams never change, unlike those of Generator.
    # Every sensor has its own, so that a change to one leaves the others as they were.
    profile = Profile(JOURNEY, np.random.RandomState(SEED))
    check_profile(profile)
    log = {
        sensor.name: measure(sensor, profile, np.random.RandomState(SEED + 1 + index))
        for index, sensor in enumerate(SENSORS)
    }
    events = inject_faults(log, profile)

    output.mkdir(parents=True, exist_ok=True)
    write(output / "log.csv", table(log_lines(log)))
    write(output / "truth.csv", table(truth_lines(profile)))
    write(output / "events.csv", table(event_lines(events)))
    write(output / "config.toml", config_text())


if __name__ == "__main__":
    main()
