"""Windows and frames: the viewer on a screen, and the same pictures without one."""
