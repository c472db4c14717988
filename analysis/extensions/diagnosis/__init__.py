"""Diagnosis: what the residuals of a fit contradict, and what gross errors would do unnoticed."""
