"""The wording that the tests of geometry expect: a rewording is entered here alone."""

A_AND_ARE_DRAWN_ABOVE_ONE = "a and b are drawn above one another; name others"
A_ARE_IN = "a, b, c are in line; name three balls"
A_SINGLE_BALL_HAS = "a single ball has no axes"
IS_NOT_DEFINED = 'calibration[0].pairs: "diameters" is not defined'
IS_NOT_DEFINED_2 = 'artefacts.plate: "corners" is not defined'
IS_NOT_DEFINED_CHOOSE = '"neighbours" is not defined .* choose from: all, or list pairs'
IS_NOT_DEFINED_LIST_THE_BALLS = '"corners" is not defined .* list the balls'
ITS_BALLS_ARE_DRAWN_ABOVE_ONE = "its balls are drawn above one another"
KIND_HAS_A_WRONG = 'artefacts.plate: kind "twins" has a wrong layout: several balls are named a;'
NAME_DIFFERENT_BALLS = "name 2 different balls, .*, one on an axis, or all"
NAME_DIFFERENT_BALLS_ONE = "name 3 different balls, .* one in the xy plane, or all"
NO_PLANE_BUT = "no plane but z"
