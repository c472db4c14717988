"""Variance components: how uncertain groups of observations are against what is stated of them."""
