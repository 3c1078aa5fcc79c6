"""Faults put into a recorded log, to see what a filter makes of them."""
