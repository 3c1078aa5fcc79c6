"""The search of ``surefix drift``: a log, diagnosed as a configuration says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surefix import _core
from surefix.config import Config
from surefix.core.checks import FloatArray
from surefix.drift.diagnosis import Diagnosis, diagnose
from surefix.drift.ending_search import MAX_ONSETS
from surefix.drift.forward_record import ForwardRecord
from surefix.errors import ConfigError
from surefix.log import Log
from surefix.tables import Columns


@dataclass(frozen=True, eq=False)
class Search:
    """A diagnosis, the passes of the filter ``before`` and ``after`` the repair; ``frequencies``
    [Hz] that were searched, None for all."""

    config: Config
    log: Log
    diagnosis: Diagnosis
    before: ForwardRecord
    after: ForwardRecord
    frequencies: FloatArray | None

    @property
    def counts(self) -> dict[str, int]:
        """Rows by what became of them."""
        rows = np.bincount(self.before.status, minlength=len(_core.STATUS_NAMES))
        return {name: int(n) for name, n in zip(_core.STATUS_NAMES, rows, strict=True) if n}

    @property
    def units(self) -> dict[str, str]:
        """Of every sensor: that of a speed is known, of others not."""
        model = self.config.model
        name, read = model.state_names[model.output], model.output
        return {
            sensor.name: "m/s"
            if name == "speed" and (sensor.observes is None or sensor.observes[read] != 0)
            else "unit"
            for sensor in self.config.sensors
        }

    def repaired(self) -> Columns:
        """The log without the faults, with its own times."""
        assert isinstance(self.diagnosis.repaired, Log)
        log = self.log
        return {"time_s": log.time, "sensor": log.sensor, "value": self.diagnosis.repaired.value}


def search(config: Config, log: Log, progress: Callable[[int, int], None]) -> Search:
    """Diagnoses a log as the table ``[drift]`` says. Raises ConfigError naming file and key."""
    engine, wanted = config.make_linear_filter(), config.drift
    record = ForwardRecord(engine, log)
    suspects = record.channels if wanted.sensors is None else wanted.sensors
    times = [record.layout.times_of(record.direction(name)) for name in suspects]
    several = [known for known in times if len(known) > 1]
    duration = max((float(known[-1] - known[0]) for known in several), default=0.0)
    interval = min((float(np.median(np.diff(known))) for known in several), default=0.0)
    try:
        grid = wanted.grid(duration, interval) if wanted.spectrum else None
        for name, known in zip(suspects, times, strict=True):
            if wanted.ends and wanted.profiles and len(known) > MAX_ONSETS:
                raise ConfigError(
                    f"ends: sensor {name!r} has {len(known)} measurements, expected at most "
                    f"{MAX_ONSETS}: ends = false, or search a part of the log"
                )
    except ConfigError as error:
        raise ConfigError(f"{config.path}: [drift] {error}") from None
    diagnosis = diagnose(
        engine, log, wanted.courses(), suspects, spectrum=wanted.spectrum, frequencies=grid,
        ends=wanted.ends, false_alarm=wanted.false_alarm, max_faults=wanted.max_faults,
        progress=progress,
    )  # fmt: skip
    assert isinstance(diagnosis.repaired, Log)
    after = ForwardRecord(engine, diagnosis.repaired) if diagnosis.detected else record
    return Search(config, log, diagnosis, record, after, grid)
