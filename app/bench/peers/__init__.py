"""Other programs that solve the same scene on the same machine: Mitsuba, and Blender's Cycles with and without a denoiser."""
