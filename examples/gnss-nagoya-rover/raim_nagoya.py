"""Three satellite systems, received at a station, through the track monitor (gnss-nagoya-rover).

``python examples/gnss-nagoya-rover/raim_nagoya.py [../shared/data/gnss-nagoya-rover] --out DIR``
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
    name="gnss-nagoya-rover",
    mask=10.0,
    stated=0.52,
    length=50.0,
    every=15,  # epochs hardly differ
    limit=5.0,
    data=Path(__file__).resolve().parents[3] / "shared" / "data" / "gnss-nagoya-rover",
)
read = RECORDING.read

if __name__ == "__main__":
    RECORDING.run()
