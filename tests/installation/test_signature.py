"""With `--trust` only an installation that is signed as a whole flies: configuration, deck, DBC and models."""

import shutil
import subprocess
from base64 import b64encode
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from tests.conftest import small_aircraft
from thrustd.__main__ import main
from thrustd.core.errors import ConfigError
from thrustd.installation.installation import CONFIG, read_installation
from thrustd.installation.signature import check_signature, manifest

KEY = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
PUBLIC = KEY.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)


@pytest.fixture
def signed(tmp_path):
    """-> (configuration, public key), the key outside of the installation."""
    folder = tmp_path / "aircraft"
    folder.mkdir()
    for name, content in small_aircraft().files.items():
        (folder / ("aircraft.toml" if name == CONFIG else name)).write_bytes(content)
    config, key = folder / "aircraft.toml", tmp_path / "trust.pem"
    key.write_bytes(PUBLIC)
    sign(config, KEY)
    return config, key


def sign(config, key):
    content = manifest(read_installation(config).hashes())
    Path(f"{config}.sig").write_bytes(b64encode(key.sign(content)) + b"\n")


def test_a_signed_installation_flies(signed):
    config, key = signed
    assert len(read_installation(config, key).files) == 8


@pytest.mark.parametrize("name", ["aircraft.toml", "deck.json", "can.dbc", "left_upper.json", "right_lower.json"])
def test_none_of_its_files_can_be_changed(signed, name):
    config, key = signed
    (config.parent / name).write_bytes((config.parent / name).read_bytes() + b"\n")
    with pytest.raises(ConfigError, match=r"aircraft.toml: signature does not match"):
        read_installation(config, key)
    read_installation(config)  # who does not ask is not told


def test_nor_can_one_take_the_place_of_another(signed):
    config, key = signed
    text = config.read_text()
    config.write_text(text.replace('"left_upper.json"', '"right_upper.json"'))
    with pytest.raises(ConfigError, match="signature does not match"):
        read_installation(config, key)


def test_who_changes_the_files_cannot_sign_them_with_a_key_of_his_own(signed):
    config, key = signed
    sign(config, Ed25519PrivateKey.from_private_bytes(bytes(32)))
    with pytest.raises(ConfigError, match="signature does not match"):
        read_installation(config, key)


def test_an_unsigned_one_does_not_fly(signed, capsys):
    config, key = signed
    Path(f"{config}.sig").unlink()
    assert main(["check", str(config), "--trust", str(key)]) == 2
    assert "aircraft.toml.sig: cannot be read: No such file" in capsys.readouterr().err
    assert main(["run", str(config), "--trust", str(key)]) == 2
    assert "aircraft.toml.sig: cannot be read: No such file" in capsys.readouterr().err
    assert main(["run", str(config), "--trust", str(key) + "x"]) == 2
    assert "trust.pemx: cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize("signature", [b"", b"????", b"AAAA", b"\xff" * 90, b64encode(bytes(64))])
def test_junk_is_no_signature(signature):
    with pytest.raises(ConfigError, match="signature does not match"):
        check_signature(b"manifest", signature, PUBLIC, "a.toml")


@pytest.mark.parametrize("key", [b"", b"junk", PUBLIC[:40]])
def test_junk_is_no_key(key):
    with pytest.raises(ConfigError, match="not an Ed25519 public key"):
        check_signature(b"manifest", b"AAAA", key, "a.toml")


def test_openssl_signs_what_we_check(signed, tmp_path, capsys):
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed here")
    config, key = signed
    private, listed, signature = tmp_path / "private.pem", tmp_path / "manifest", tmp_path / "signature"
    assert main(["check", str(config), "--manifest"]) == 0
    listed.write_text(capsys.readouterr().out)
    openssl("genpkey", "-algorithm", "ed25519", "-out", str(private))
    openssl("pkeyutl", "-sign", "-rawin", "-inkey", str(private), "-in", str(listed), "-out", str(signature))
    key.write_bytes(openssl("pkey", "-in", str(private), "-pubout").stdout)
    Path(f"{config}.sig").write_bytes(b64encode(signature.read_bytes()))
    assert main(["check", str(config), "--trust", str(key)]) == 0


def openssl(*arguments):
    return subprocess.run(["openssl", *arguments], check=True, capture_output=True)
