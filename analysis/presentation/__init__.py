"""Forms of tables and pictures in which results are shown."""
