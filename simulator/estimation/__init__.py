"""Estimation from a design and its readings: blocks, elimination, Gauss-Newton, starting values."""
