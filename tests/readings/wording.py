"""The wording that the tests of readings expect: a rewording is entered here alone."""

ITS_TIPS_ARE_UP = "own.csv: stars[0]: its tips are up to "
MM_FROM_THE_STATED_OFFSETS = "5.0 mm from the stated offsets"
