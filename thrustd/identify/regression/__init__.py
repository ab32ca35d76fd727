"""The estimator: one regression with priors whose strengths come from the data. See `regress`."""
