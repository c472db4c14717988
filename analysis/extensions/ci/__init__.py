"""Checks as reports for build servers: annotations of GitHub and JUnit."""
