"""Judgement of a fit: error models, data left out, bootstrap, variance components, budget."""
