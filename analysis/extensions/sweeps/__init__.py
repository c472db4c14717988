"""Families of experiments: their axes, the store of results, and the distribution of the work."""
