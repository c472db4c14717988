"""Pages of results, self-contained HTML made of sections that are functions of results, and joint
tables.
"""
