"""Constrained splines of a machine's error curves."""
