"""Errors of surefix. Each names the argument, its value or shape, and what was expected."""

from __future__ import annotations


class SurefixError(Exception):
    """Base of all errors that surefix raises on purpose."""


class ShapeError(SurefixError, ValueError):
    """An array has the wrong shape."""


class ConfigError(SurefixError, ValueError):
    """A value, a name or a file does not describe what it should."""


class NumericalError(SurefixError, ArithmeticError):
    """A result does not exist or cannot be represented (a singular matrix, an overflow)."""
