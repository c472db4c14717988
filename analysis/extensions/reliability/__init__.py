"""Reliability: which gross errors residuals would show, and what undetected ones would do."""
