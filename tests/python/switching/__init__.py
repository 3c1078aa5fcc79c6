"""Tests of the switching filters. A package, because other tests have modules of the same names."""
