"""Slow and obvious answers that judge the solvers: a dense matrix, closed forms, path tracing, and metrics of error."""
