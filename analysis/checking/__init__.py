"""Checks of many files, and their reports for build servers."""
