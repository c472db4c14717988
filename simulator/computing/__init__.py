"""Threads, processes, memory, progress and rounding of computations."""
