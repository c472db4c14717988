"""Experiment files drafted from the data sheet of a machine."""
