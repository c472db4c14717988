"""Judgement of a fit: error models, data left out, budget."""
