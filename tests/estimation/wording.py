"""The wording that the tests of estimation expect: a rewording is entered here alone."""

A_STANDARD_UNCERTAINTY_MUST_BE_ABOVE = "r.csv:32:1: a standard uncertainty must be above zero"
IS_FOR_TWO_DIMENSIONS = "level: is for two dimensions; remove it"
IS_HELD_TO_FIX_THE_FRAME = '"z low: origin x" is held, to fix the frame'
