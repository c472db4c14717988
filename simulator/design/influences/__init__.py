"""Influence quantities: what disturbs readings in the laboratory, one file for each kind."""
