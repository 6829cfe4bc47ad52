"""A page that shows a bake in three.js, as one file: library, scene and light are in it, so that it needs neither a network nor
a web server.

Scripts of a page that was opened from a disk may not load others beside it; what an import map names as ``data:`` they may.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app.errors import UserError
from app.scene.sky import SUN_ANGLE, Sky

HERE = Path(__file__).parent / "web"
OLDEST = 152  # release of three.js whose lightmaps choose their texture coordinates
ADDONS = ("controls/OrbitControls.js", "loaders/EXRLoader.js", "loaders/GLTFLoader.js")
RELATIVE = re.compile(r"""(\bfrom\s*|\bimport\s*)(['"])(\.\.?/[^'"]+)\2""")
SHOWN = ("camera", "exposure", "tone_map")  # of a report


def find_three(given: str | None = None) -> Path:
    """The folder of the npm package three: the one given, or node_modules/three here or in a folder above. Raises UserError."""
    here = Path.cwd()
    tried = [Path(given)] if given else [folder / "node_modules" / "three" for folder in (here, *here.parents)]
    for folder in tried:
        try:
            version = json.loads((folder / "package.json").read_text(encoding="utf-8"))["version"]
            release = int(version.split(".")[1])
        except (OSError, ValueError, LookupError, TypeError, AttributeError):
            continue
        if release < OLDEST:
            raise UserError(
                f"--web: {folder} is three.js r{release}, r{OLDEST} or newer is needed: npm install three@latest"
            )
        return folder
    where = f"is not in {given}" if given else "is neither here nor in a folder above"
    raise UserError(
        f"--web: the npm package three {where}: npm install three, or --three and the folder of the package"
    )


def web_page(
    title: str, files: Mapping[str, bytes], report: Mapping[str, Any], three: Path, *, sky: Sky | None = None
) -> str:
    """The page. files: scene.glb, its lightmaps and the sky, by name; report: of the bake; three: the folder of the package; sky:
    of the scene, whose sun is none of those files."""
    known = {name: report[name] for name in SHOWN} | {"sun": None if sky is None else _sun(sky)}
    about = json.dumps(known).replace("<", "\\u003c")
    data = [f'<script type="application/json" id="about">{about}</script>']
    for name, content in files.items():
        data.append(f'<script type="text/plain" id="{html.escape(name)}">{base64.b64encode(content).decode()}</script>')
    parts = {
        "title": html.escape(title),
        "importmap": json.dumps({"imports": _modules(three)}),
        "data": "\n".join(data),
        "script": (HERE / "page.js").read_text(encoding="utf-8"),
    }
    page = (HERE / "page.html").read_text(encoding="utf-8")
    return re.sub(r"<!--(\w+)-->", lambda found: parts[found[1]], page)


def _sun(sky: Sky) -> dict[str, Any] | None:
    """Its disc: where it is, its angle across and its radiance [W/(sr m²)]."""
    if sky.sun is None:
        return None
    return {"towards": sky.sun.direction.tolist(), "angle": SUN_ANGLE, "radiance": sky.sun_radiance.tolist()}


def _modules(three: Path) -> dict[str, str]:
    """Each module that the page needs as ``data:``, under the name that it is imported by."""
    entries = (f"build/{name}" for name in ("three.module.min.js", "three.module.js"))
    build = next((entry for entry in entries if (three / entry).is_file()), "build/three.module.js")
    named = {"three": build} | {f"three/addons/{name}": f"examples/jsm/{name}" for name in ADDONS}
    waiting, sources = list(named.values()), dict[str, str]()
    while waiting:
        path = waiting.pop()
        if path in sources:
            continue
        try:
            text = (three / path).read_text(encoding="utf-8")
        except OSError as error:
            raise UserError(f"--web: {three / path} cannot be read: {error.strerror}") from error
        folder = (three / path).parent

        def bare(found: re.Match[str], folder: Path = folder) -> str:
            other = (folder / found[3]).resolve()
            if not other.is_file() or not other.is_relative_to(three.resolve()):
                return found[0]
            waiting.append(other.relative_to(three.resolve()).as_posix())
            return f"{found[1]}{found[2]}three/{waiting[-1]}{found[2]}"

        sources[path] = RELATIVE.sub(bare, text)
    urls = {f"three/{path}": _url(text) for path, text in sources.items()}
    return urls | {name: urls[f"three/{path}"] for name, path in named.items()}


def _url(script: str) -> str:
    return "data:text/javascript;base64," + base64.b64encode(script.encode()).decode()
