"""Extensions that are shipped: each one a folder, which the rest of ballplate does not import."""
