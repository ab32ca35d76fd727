"""In-flight jet thrust from the deformation of the engine mounts."""

__version__ = "0.1.0"
