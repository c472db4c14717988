"""Readings: simulated, read from files, and checked for gross errors."""
