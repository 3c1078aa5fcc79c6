"""Tests of train positioning. A package, because other tests have modules of the same names."""
