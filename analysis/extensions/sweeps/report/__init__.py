"""A sweep's results as a page and as tables, from its store alone."""
