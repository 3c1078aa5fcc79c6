"""Interrupted and noisy measurements (Sigalov & Oshman)."""
