"""The picture of a lightmap: layers, tone curves, false colour, overlays, and what lies under a pixel."""
