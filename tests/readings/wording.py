"""The wording that the tests of readings expect: a rewording is entered here alone."""
