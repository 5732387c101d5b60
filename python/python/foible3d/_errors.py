"""The exceptions of foible3d."""


class DeformableBodyError(ValueError):
    """A mesh, material, vertex, array or value that foible3d refuses; the text says which and why."""


class InvalidHandle(KeyError):
    """A handle that names nothing: what it named was removed, or is in another world."""

    # That of KeyError would put the text in quotes.
    __str__ = Exception.__str__


class UnknownSignal(KeyError):
    """A name that no signal of the world has."""

    __str__ = Exception.__str__


class SnapshotError(ValueError):
    """Bytes that are no snapshot of a world, damaged, or of another version."""


for _class in (DeformableBodyError, InvalidHandle, UnknownSignal, SnapshotError):
    _class.__module__ = "foible3d"
