"""Whether the innovations are what the model says: of the size it claims, and independent. Where
they are not, no p-value that rests on the model holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from surefix.core.checks import FloatArray
from surefix.drift.diagnosis import Diagnosis
from surefix.drift.forward_record import ForwardRecord
from surefix.log import Log

SIZES = 0.5, 2.0
"""NIS per measurement within which a model is not called wrong; it is 1 if the model holds."""
LAGS = 10
CORRELATED = 0.1
CLIP = 3.0  # a few gross errors are no correlation
BY_CHANCE = 5.0  # standard errors
FEW = 30  # measurements, of which nothing is said


def whiteness(record: ForwardRecord, log: Log) -> dict[str, dict[str, Any]]:
    """Of every sensor: measurements used, their mean νᵀS⁻¹ν, and that correlation of its normalised
    innovations, clipped, with those 1 to ``LAGS`` before which is largest in magnitude."""
    values = (record.innovations * np.sqrt(record.engine.inverse))[0]
    code = log.codes_for(record.channels)[record.engine.ids]
    found = {}
    for c, name in enumerate(record.channels):
        own = values[code == c]
        found[name] = {
            "measurements": len(own),
            "nis": float(np.mean(own**2)) if len(own) else None,
            "correlation": _correlation(own),
        }
    return found


def _correlation(normalised: FloatArray) -> float | None:
    values = np.clip(normalised, -CLIP, CLIP)
    power = float(np.sum(values**2))
    if len(values) < FEW or power == 0:
        return None
    lags = [float(np.sum(values[k:] * values[:-k])) / power for k in range(1, LAGS + 1)]
    return max(lags, key=abs)


def warnings(
    diagnosis: Diagnosis, sensors: dict[str, dict[str, Any]], most: int, cut: float | None
) -> list[str]:
    """What speaks against the findings. ``sensors``: their ``whiteness`` after the repair; ``most``
    faults were looked for; ``cut`` [Hz]: frequency beyond which nothing was, though it could."""
    found = []
    when = "after the repair" if diagnosis.detected else "with nothing repaired"
    sizes = {"all sensors": diagnosis.after.nis} if len(sensors) > 1 else {}
    enough = {name: one for name, one in sensors.items() if one["measurements"] >= FEW}
    sizes |= {name: one["nis"] for name, one in enough.items()}
    for name, nis in sizes.items():
        if not SIZES[0] <= nis <= SIZES[1]:
            claim = "too little noise" if nis > 1 else "too much noise"
            effect = "faults may be false alarms" if nis > 1 else "faults may be missed"
            found.append(
                f"{name}: NIS per measurement {nis:.3g} {when}, 1 if the model holds: it claims "
                f"{claim}, so the p-values and ± do not hold and {effect}"
            )
    for name, one in enough.items():
        r = one["correlation"]
        if r is not None and abs(r) > max(CORRELATED, BY_CHANCE / one["measurements"] ** 0.5):
            found.append(
                f"{name}: innovations are correlated by {r:.2f} {when}, 0 if the model holds: "
                "small faults may be what the model leaves out, the p-values do not hold"
            )
    if len(diagnosis.faults) >= most:
        found.append(
            f"{most} found and no more looked for (max_faults): there may be others, or the model "
            "does not hold"
        )
    if cut is not None:
        found.append(
            f"oscillations were looked for up to {cut:.4g} Hz: [drift] frequencies sets the range"
        )
    return found
