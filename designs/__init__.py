"""Experiment files that come with ballplate: those of published documents, a first one, and what they name."""
