"""Whether a fit is to be believed: model ladder, readings left out, campaigns, own data sets."""
