"""A GPS receiver that stands still, for an hour, through the track monitor (gnss-geonet-0759).

``python examples/gnss-geonet-0759/raim_geonet.py [../shared/data/gnss-geonet-0759] --out DIR``
lets a track of 1000 m radius pass through the station, to the east and to the north, counts false
alarms on the recording as it is, puts biases on its satellites, and compares what is detected with
what was predicted; it prints tables and writes figures.json, figure.png and stanford.png into DIR.
What it shows: docs/recordings-raim.md.
"""

from __future__ import annotations

from pathlib import Path

from surefix.studies.recorded_run import Recording

# Elevation mask and σ at the zenith, of a solution in three dimensions, as the recording's
# description has them.
RECORDING = Recording(
    name="gnss-geonet-0759",
    mask=10.0,
    stated=0.45,
    length=50.0,
    every=1,
    limit=10.0,
    data=Path(__file__).resolve().parents[3] / "shared" / "data" / "gnss-geonet-0759",
)
read = RECORDING.read

if __name__ == "__main__":
    RECORDING.run()
