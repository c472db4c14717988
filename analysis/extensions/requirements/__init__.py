"""Accuracies of equipment that a target uncertainty requires."""
