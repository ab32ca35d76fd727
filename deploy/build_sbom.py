"""Write deploy/sbom.cdx.json (CycloneDX 1.6): every package of requirements.txt with its version and SHA-256.

pip install cyclonedx-python-lib && python deploy/build_sbom.py        the same input gives the same file
"""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

HERE = Path(__file__).parent
LINE = re.compile(r"(\S+)==(\S+) --hash=sha256:([0-9a-f]{64})")


def component(name: str, version: str, sha256: str) -> Component:
    url = PackageURL("pypi", None, name.lower().replace("_", "-"), version)
    digest = HashType(alg=HashAlgorithm.SHA_256, content=sha256)
    return Component(name=name, version=version, purl=url, bom_ref=str(url), hashes=[digest])


def main() -> None:
    project = tomllib.loads((HERE.parent / "pyproject.toml").read_text())["project"]
    bom = Bom(components=[component(*found) for found in LINE.findall((HERE / "requirements.txt").read_text())])
    top = Component(name=project["name"], version=project["version"], type=ComponentType.APPLICATION, bom_ref="thrustd")
    bom.metadata.component = top
    bom.register_dependency(top, bom.components)
    content: dict[str, Any] = json.loads(JsonV1Dot6(bom).output_as_string())
    del content["serialNumber"], content["metadata"]["timestamp"]  # of this run, not of what flies
    (HERE / "sbom.cdx.json").write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
