"""Parts that a machine is to measure, and tests of the machine by measuring lengths."""
