"""Reference implementations in plain NumPy, written from the papers and never from the engine.

They are slow and short on purpose: every formula stands beside its equation number, so that a
disagreement with the engine can be settled by reading.
"""
