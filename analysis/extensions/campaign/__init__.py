"""Campaigns: the run sheet, the next position, and readings of interrupted days."""
