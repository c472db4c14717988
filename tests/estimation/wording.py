"""The wording that the tests of estimation expect: a rewording is entered here alone."""

IS_FOR_TWO_DIMENSIONS = "level: is for two dimensions; remove it"
IS_HELD_TO_FIX_THE_FRAME = '"z low: origin x" is held, to fix the frame'
