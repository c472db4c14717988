"""Experiment files: their keys, loading, and messages about errors in them."""
