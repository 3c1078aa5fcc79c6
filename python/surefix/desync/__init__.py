"""The desynchronized filter: asynchronous measurements, one estimate per step (Bilenne 2004)."""
