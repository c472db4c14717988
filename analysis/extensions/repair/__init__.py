"""Search for the cheapest changes after which a design determines everything."""
