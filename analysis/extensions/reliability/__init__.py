"""Reliability: gross errors that residuals reveal, and effects of undetected ones."""
