"""Claimed against measured risk of the robust filter, under its own model and outside of it."""

from __future__ import annotations

from surefix.validation.measure import validate

__all__ = ["validate"]
