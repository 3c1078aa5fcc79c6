"""Slow faults: the likelihood's gradient, ramps, steps, sinusoids."""
