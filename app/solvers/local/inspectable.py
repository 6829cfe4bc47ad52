"""What the local matrix shows of itself."""

from __future__ import annotations

from app.scene.model import F64
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.lighting import Lighting
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.options import LocalOptions
from app.solvers.local.patches import Patches
from app.solvers.local.rows import Rows
from app.solvers.local.selection import distances

NOTED = 0.02  # of the light, that the matrix is off by, from which on it is said


def figures_of(
    held: LocalSet, patches: Patches, rows: Rows, matrix: LocalMatrix, lighting: Lighting, observer: F64, scale: float
) -> dict[str, str]:
    """Of the set and what it takes. observer: [solver space]; scale: metres of its unit."""
    nodes = held.nodes
    fine = nodes[patches.level[nodes] == 0]
    reach = float(distances(patches, fine, observer).max(initial=0.0)) * scale
    clusters = len(nodes) - len(fine)
    return {
        "Local set": f"{len(fine):,} of {patches.count:,} patches" + (f", {clusters:,} clusters" if clusters else ""),
        "Patches reach": f"{reach:.3g} m",
        "Light from outside": f"{100 * lighting.from_outside:.1f} %",
        "Matrix": f"{matrix.memory / 2**20:.1f} MiB",
        "Rows": f"{rows.made:,}, {rows.memory / 2**20:.1f} MiB"
        + (f", {rows.from_disk:,} from disk" if rows.from_disk else ""),
    }


def facts_of(node: int, slot: int, patches: Patches, age: int, share: float) -> dict[str, str]:
    """Of the node that a texel is in. age: pieces of work since it entered; share: of what it sees that is outside of the set."""
    if slot < 0:
        return {"Local set": "not in it"}
    texels = int(patches.end[node] - patches.start[node])
    kind = "patch" if patches.level[node] == 0 else f"cluster of level {patches.level[node]}"
    return {"Local set": f"{kind}, {texels:,} texels, {age:,} pictures ago", "Sees of outside": f"{100 * share:.1f} %"}


def note_of(error: float, matrix: LocalMatrix, options: LocalOptions) -> str | None:
    """What to do where the matrix has lost much of the light. error: the share of it."""
    if error <= NOTED or not matrix.coloured:
        return None
    exact = "--bounces iterate" if options.bits == 32 else "--bits 32 or --bounces iterate"
    better = "--bounces inverse" if options.bounces == "series" else exact
    return f"the local matrix is off by {error:.0%} of the light: {better} would do"
