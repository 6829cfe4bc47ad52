"""One open scene and its solution: opened, solved, paced, compared, looked at."""
