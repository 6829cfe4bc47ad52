"""Other programs on the same plot."""
