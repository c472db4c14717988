"""What keeps figures the same on every machine."""
