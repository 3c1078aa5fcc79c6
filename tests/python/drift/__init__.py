"""Tests of the drift detectors. A package, because other tests have modules of the same names."""
