"""Ways to see the scene from a shooter. One line here is all that a new one needs besides its GLSL."""

from app.visibility.occluders import Casters, Occluders
from app.visibility.projections.base import Projection

PROJECTIONS = {
    p.name: p
    for p in (
        Projection("hemicube", "hemicube", 5, 3, 1, 4, Occluders.whole),
        Projection("stereographic", "hemisphere", 1, 2, 2, 1, Occluders.tessellated),
        Projection("nonlinear", "hemisphere", 1, 2, 2, 4, Occluders.fetched),
    )
}

__all__ = ["PROJECTIONS", "Casters", "Occluders", "Projection"]
