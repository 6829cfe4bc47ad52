"""Ways to see the scene from a shooter. One line here is all that a new one needs besides its GLSL."""

from app.projections.base import Projection

PROJECTIONS = {p.name: p for p in (Projection("hemicube", views=5, width=3, height=1),)}

__all__ = ["PROJECTIONS", "Projection"]
