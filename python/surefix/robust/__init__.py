"""Fault hypotheses, their mixture, and alert limits that hold."""
