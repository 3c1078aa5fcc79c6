"""Tests of the robust filter. A package, because other tests have modules of the same names."""
