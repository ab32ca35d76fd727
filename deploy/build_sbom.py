"""Write deploy/sbom.cdx.json (CycloneDX 1.6): every package of requirements.txt, its version, licence and SHA-256s.

pip install cyclonedx-python-lib && python deploy/build_sbom.py        the same input gives the same file

Licences are those that the packages installed here state: an SPDX expression, else their classifiers or first words;
which BSD licence it is, their own text says.
"""

import json
import re
import tomllib
from importlib.metadata import distribution, metadata
from pathlib import Path
from typing import Any

from cyclonedx.factory.license import LicenseFactory
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

HERE = Path(__file__).parent
LINE = re.compile(r"(\S+)==(\S+)((?: --hash=sha256:[0-9a-f]{64})+)")
OWN_TEXT = 2500  # characters: the licences of what a package carries along come behind its own
CLASSIFIER = "License :: OSI Approved :: "
EITHER_BSD = "BSD", "BSD License"
IN_SOURCE = {"pyserial": "BSD-3-Clause"}  # SPDX-License-Identifier of every file of it; its wheel brings no text
SPDX = {  # only what is unambiguous
    "MIT License": "MIT",
    "Apache License, Version 2.0": "Apache-2.0",
    "Apache 2.0": "Apache-2.0",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0-only",
}


def component(name: str, version: str, hashes: str) -> Component:
    url = PackageURL("pypi", None, name.lower().replace("_", "-"), version)
    digests = [HashType(alg=HashAlgorithm.SHA_256, content=digest[-64:]) for digest in hashes.split()]
    licence = LicenseFactory().make_from_string(licence_of(name))
    return Component(name=name, version=version, purl=url, bom_ref=str(url), hashes=digests, licenses=[licence])


def licence_of(name: str) -> str:
    """As the installed package states it."""
    about = metadata(name)
    stated = [line.removeprefix(CLASSIFIER) for line in about.get_all("Classifier", []) if line.startswith(CLASSIFIER)]
    words = about.get("License-Expression") or (about.get("License") or "").strip()
    if not words or len(words) > 60:  # some give the whole text
        words = " OR ".join(SPDX.get(line, line) for line in stated) or words.partition("\n")[0]
    return _which_bsd(name) if words in EITHER_BSD else SPDX.get(words, words)


def _which_bsd(name: str) -> str:
    """Of two clauses or three: the third keeps the authors' names out of advertising."""
    if name in IN_SOURCE:
        return IN_SOURCE[name]
    files = [file for file in distribution(name).files or () if file.name.upper().startswith(("LICEN", "COPYING"))]
    own = min(files, key=lambda file: len(file.parts)).read_text(encoding="utf-8")[:OWN_TEXT]
    if "Redistribution" not in own:
        raise SystemExit(f"{name}: no BSD licence in {files}")
    return "BSD-3-Clause" if "endorse or" in " ".join(own.split()) else "BSD-2-Clause"


def main() -> None:
    project = tomllib.loads((HERE.parent / "pyproject.toml").read_text())["project"]
    bom = Bom(components=[component(*found) for found in LINE.findall((HERE / "requirements.txt").read_text())])
    top = Component(name=project["name"], version=project["version"], type=ComponentType.APPLICATION, bom_ref="thrustd")
    top.licenses.add(LicenseFactory().make_from_string(project["license"]))
    bom.metadata.component = top
    bom.register_dependency(top, bom.components)
    content: dict[str, Any] = json.loads(JsonV1Dot6(bom).output_as_string())
    del content["serialNumber"], content["metadata"]["timestamp"]  # of this run, not of what flies
    (HERE / "sbom.cdx.json").write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
