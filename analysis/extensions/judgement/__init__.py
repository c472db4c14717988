"""Judgement of a fit: model ladder, data left out, bootstrap, variance components, budget."""
