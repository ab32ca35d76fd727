"""Ed25519 signature of a whole installation (RFC 8032): whoever holds the private key says what may fly.

Signed is the manifest, `sha256  name` line by line: the configuration and every file it names (deck, DBC, models), so
that none of them can be exchanged for one of another aircraft or of last year. The public key comes from whoever starts
the process, never from the installation itself: who may change its files could change that, too.

    openssl genpkey -algorithm ed25519 -out private.pem;  openssl pkey -in private.pem -pubout -out trust.pem
    thrustd check ph-lab.toml --manifest > manifest
    openssl pkeyutl -sign -rawin -inkey private.pem -in manifest | base64 -w0 > ph-lab.toml.sig
    thrustd run ph-lab.toml --trust trust.pem
"""

from base64 import b64decode
from collections.abc import Mapping

from thrustd.core.errors import ConfigError

SIGNATURE = ".sig"  # added to the configuration's file name


def manifest(sha256: Mapping[str, str]) -> bytes:
    """What is signed; `sha256` of every file by name, in hexadecimal."""
    return "".join(f"{digest}  {name}\n" for name, digest in sorted(sha256.items())).encode()


def check_signature(content: bytes, signature: bytes, public_key: bytes, where: str) -> None:
    """ConfigError unless `signature` (base64) over `content` is by the holder of `public_key` (PEM)."""
    from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm  # 0.1 s that only some have to wait
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    try:
        key = load_pem_public_key(public_key)
    except (ValueError, UnsupportedAlgorithm):
        key = None
    if not isinstance(key, Ed25519PublicKey):
        raise ConfigError(f"{where}: the key of --trust is not an Ed25519 public key in PEM")
    try:
        key.verify(b64decode(signature, validate=False), content)
    except (InvalidSignature, ValueError):
        raise ConfigError(
            f"{where}: signature does not match: the configuration or a file it names was changed since it was signed, "
            "or by another key; expected one of the key of --trust"
        ) from None
