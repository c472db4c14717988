"""Planning: positions chosen from a pool, their order, the design as a file, and its repair."""
