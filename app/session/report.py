"""What a solve came to, for people and for programs."""

from __future__ import annotations

from typing import Any

from app import __version__
from app.render.exposure import exposure_of
from app.render.options import DisplayOptions
from app.render.seen import seen_texels
from app.scene.load import NO_LIGHT
from app.scene.model import F64
from app.scene.options import FileOptions
from app.session.balance import per_cent, verdict_of
from app.session.session import Reading, Session
from app.session.view import View

__all__ = ["look_of", "notes", "picture", "report", "summary"]


def report(session: Session) -> dict[str, Any]:
    """Everything that shaped the solution and what came of it."""
    stats, balance, run = session.stats, session.run.energy, session.run
    return {
        "glowtree": __version__,
        "scene": session.name,
        "source": str(session.source),
        "renderer": session.gpu.limits.renderer,
        "gl_version": session.gpu.limits.version,
        "parameters": session.parameters | _read_as(session.reading),
        "charts": {"count": stats.charts, "method": session.charts.method, "texels_per_metre": session.charts.density},
        "triangles": stats.triangles,
        "texels": stats.texels,
        "atlas": list(session.charts.size),
        "memory_mib": stats.memory_mib,
        stats.unit: stats.done,
        session.family.threshold: stats.remaining,
        "converged": stats.converged,
        "interrupted": run.interrupted,
        "resumed": run.earlier > 0,
        "seconds": {**session.load_seconds, "solve": stats.seconds},
        "energy_w": {
            name: [float(x) for x in getattr(balance, name)]
            for name in ("emitted", "absorbed", "escaped", "unshot", "imbalance")
        },
        "imbalance": stats.imbalance,
        "balance": ("fine", "fair", "bad")[verdict_of(stats.imbalance, session.family).level],
        **_error(session),
        **({} if session.expected is None else {"expected_error": session.expected._asdict()}),
        "warnings": [*_of_opening(session), *notes(session)],
    }


def _of_opening(session: Session) -> list[str]:
    """What was repaired, left out or could not be done as it was opened; not that it has no light, where it was given some
    since."""
    lit = session.edited_scene.emits
    return [warning for warning in session.warnings if not (lit and warning == NO_LIGHT)]


def _read_as(reading: Reading) -> dict[str, Any]:
    """How the file was read, and which sky it was given."""
    given = None if reading.sky is None else reading.sky.as_dict()
    return {"file": (reading.file or FileOptions()).as_dict(), "given_sky": given}


def picture(session: Session) -> dict[str, Any]:
    """How the viewer would show the light at first, as ``look_of`` has it of a view: camera, exposure [EV], tone curve. Waits
    for the GPU."""
    camera, balance = session.scene.cameras[0], session.run.energy
    seen = seen_texels(session.lightmap.pool, camera.world_from_camera, camera.yfov)
    unshot, emitted = (power / max(balance.area, 1e-300) for power in (balance.unshot, balance.emitted))
    exposure = exposure_of(session.lightmap, seen, unshot, emitted)
    return _look(camera.name, camera.world_from_camera, camera.yfov, exposure, DisplayOptions().tone_map)


def look_of(view: View) -> dict[str, Any]:
    """How a view shows the light: its camera, exposure [EV] and tone curve."""
    camera, display = view.camera, view.display
    return _look("view", camera.world_from_camera, camera.yfov, display.exposure, display.tone_map)


def _look(name: str, world_from_camera: F64, yfov: float, exposure: float, tone_map: str) -> dict[str, Any]:
    camera = {"name": name, "yfov": yfov, "world_from_camera": world_from_camera.tolist()}
    return {"camera": camera, "exposure": exposure, "tone_map": tone_map}


def _error(session: Session) -> dict[str, Any]:
    """Against the reference, at random points; nothing without one."""
    comparison = session.compared.comparison
    if comparison is None or comparison.error is None:
        return {}
    light = comparison.light
    known = {"reference": light.name, "reference_texels": light.texels, "reference_residual": light.unshot}
    return {"error": known | {"points": comparison.lit} | comparison.error._asdict()}


def notes(session: Session) -> list[str]:
    """What the solver has to say of the solution, and what its energy balance says of it."""
    note, stats = session.run.progress.note, session.stats
    verdict = verdict_of(stats.imbalance, session.family, stats.remaining, finer=session.finer_maps)
    found = [] if note is None else [note]
    if verdict.text is not None and verdict.known:
        found.append(verdict.text)
    return found


def summary(session: Session, result: dict[str, Any]) -> str:
    """One line of it."""
    stats = session.stats
    error = result.get("error")
    compared = "" if error is None else f", off by {error['rms']:.2%} RMS and {error['median']:.2%} in the median"
    expected = result.get("expected_error")
    if expected is not None:
        compared += f", expected to be off by {expected['rms']:.1%} RMS and {expected['median']:.1%} in the median"
    state = "stopped early" if result["interrupted"] else "converged" if result["converged"] else "stopped as asked"
    return (
        f"{session.family.words(stats.done)} in {stats.seconds:.1f} s, {stats.remaining:.2%} {stats.remains} ({state}), "
        f"{result['texels']} texels, energy imbalance {per_cent(result['imbalance'], '+z')}{compared}, "
        f"{result['renderer']}"
    )
