"""Direct light: what comes straight from lamps, by shadow rays."""
