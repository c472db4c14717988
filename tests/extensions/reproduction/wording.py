"""The wording that the tests of reproduction expect: a rewording is entered here alone."""

NOT_EVERYTHING_COMPARED_AGREES = "NOT everything compared agrees"
NO_CERTIFIED_PROBLEMS_HERE = "no certified problems here"
NO_EXPERIMENT_DID_YOU_MEAN = 'no experiment "6.2.9"; did you mean'
NO_PROBLEM_DID_YOU_MEAN = 'no problem "three planes"; did you mean "three-planes"?'
NO_SUCH_FOLDER = "no such folder; name that of the shipped designs"
THE_QUANTILES_OF_DATA_SETS = "the quantiles of 3 data sets"
