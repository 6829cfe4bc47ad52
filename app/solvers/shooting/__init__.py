"""Progressive radiosity: one shot is ``Batch.shoot`` in batch.py; the solver that makes them is in solver.py."""
