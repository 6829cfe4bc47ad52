"""Error of the irradiance against time and work, for each method and for other programs."""
