"""Ed25519 signatures of model artifacts (RFC 8032): whoever holds the private key says which models may fly.

openssl genpkey -algorithm ed25519 -out private.pem;  openssl pkey -in private.pem -pubout -out models.pem
openssl pkeyutl -sign -rawin -inkey private.pem -in MODEL.json | base64 -w0 > MODEL.json.sig
"""

from base64 import b64decode

from thrustd.core.errors import ConfigError, ModelError

SIGNATURE = ".sig"  # added to the model's file name


def check_signature(content: bytes, signature: bytes, public_key: bytes, where: str) -> None:
    """ModelError unless `signature` (base64) over `content` is by the holder of `public_key` (PEM)."""
    from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm  # 0.1 s that only some have to wait
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from cryptography.hazmat.primitives.serialization import load_pem_public_key

    try:
        key = load_pem_public_key(public_key)
    except (ValueError, UnsupportedAlgorithm):
        key = None
    if not isinstance(key, Ed25519PublicKey):
        raise ConfigError(f"{where}: trust.public_key is not an Ed25519 key in PEM")
    try:
        key.verify(b64decode(signature, validate=False), content)
    except (InvalidSignature, ValueError):
        raise ModelError(f"{where}: signature does not match, expected one by the key of trust.public_key") from None
