"""With `trust` in the configuration only models signed with that key fly."""

import shutil
import subprocess
from base64 import b64encode

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from tests.conftest import small_aircraft
from thrustd.core.errors import ConfigError, ModelError
from thrustd.installation.installation import CONFIG, installation_from_files
from thrustd.installation.signature import check_signature

KEY = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
PUBLIC = KEY.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
TRUST = b'\n[trust]\npublic_key = "models.pem"\n'


def signed_files():
    files = dict(small_aircraft().files)
    files[CONFIG] += TRUST
    models = [name for name in files if name.endswith("er.json")]
    return files | {f"{name}.sig": b64encode(KEY.sign(files[name])) + b"\n" for name in models} | {"models.pem": PUBLIC}


def test_signed_models_fly():
    installation_from_files(signed_files(), "test").parts()


def test_a_changed_model_does_not():
    files = signed_files()
    files["left_lower.json"] += b" "
    with pytest.raises(ModelError, match=r"left_lower.json: signature does not match"):
        installation_from_files(files, "test").parts()


def test_a_model_signed_by_somebody_else_does_not():
    files = signed_files()
    other = Ed25519PrivateKey.from_private_bytes(bytes(32))
    files["left_upper.json.sig"] = b64encode(other.sign(files["left_upper.json"]))
    with pytest.raises(ModelError, match="signature does not match"):
        installation_from_files(files, "test").parts()


@pytest.mark.parametrize("signature", [b"", b"????", b"AAAA", b"\xff" * 90, b64encode(bytes(64))])
def test_junk_is_no_signature(signature):
    with pytest.raises(ModelError, match="signature does not match"):
        check_signature(b"model", signature, PUBLIC, "model.json")


@pytest.mark.parametrize("key", [b"", b"junk", PUBLIC[:40]])
def test_junk_is_no_key(key):
    with pytest.raises(ConfigError, match="not an Ed25519 key"):
        check_signature(b"model", b"AAAA", key, "model.json")


def test_openssl_signs_what_we_check(tmp_path):
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed here")
    private, model, signature = tmp_path / "private.pem", tmp_path / "model.json", tmp_path / "signature"
    model.write_bytes(b"a model")
    openssl("genpkey", "-algorithm", "ed25519", "-out", str(private))
    openssl("pkeyutl", "-sign", "-rawin", "-inkey", str(private), "-in", str(model), "-out", str(signature))
    public = openssl("pkey", "-in", str(private), "-pubout").stdout
    check_signature(b"a model", b64encode(signature.read_bytes()), public, "model.json")


def openssl(*arguments):
    return subprocess.run(["openssl", *arguments], check=True, capture_output=True)
