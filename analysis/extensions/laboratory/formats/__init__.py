"""Formats of programs for co-ordinate measuring machines, one file each.

A format says whether a file is of it and reads it as a report of features. To add one, write its
file and add it to `FORMATS`.
"""
