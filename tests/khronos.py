"""What Khronos' glTF validator says of a file."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

from npm import npm_package

VALIDATOR = "gltf-validator@2.0.0-dev.3.10"
VALIDATE = """
const fs = require('fs'), path = require('path');
const file = process.argv[1], folder = path.dirname(file);
const read = uri => fs.promises.readFile(path.join(folder, uri)).then(data => new Uint8Array(data));
require('gltf-validator').validateBytes(new Uint8Array(fs.readFileSync(file)), {externalResourceFunction: read})
    .then(report => console.log(JSON.stringify(report.issues)));
"""


def validator_messages(path: Path) -> list[dict[str, object]]:
    """All of its messages; severity 0 is an error, 1 a warning. The test is skipped where it cannot be installed."""
    folder = npm_package(VALIDATOR).parent
    line = ["node", "-e", VALIDATE, str(path)]
    run = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=120, check=True)
    found: list[dict[str, object]] = json.loads(run.stdout)["messages"]
    return found
