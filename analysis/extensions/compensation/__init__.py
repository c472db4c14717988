"""Compensation tables of machines: errors at nodes, in the formats that controllers read."""
