"""Work spread over processes, how far it is, and what it needs."""
