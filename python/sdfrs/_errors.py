"""The errors of the package: one base, one class per kind of fault.

The compiled module raises these very classes, so that ``except sdfrs.Error``
catches whatever the package itself refuses.
"""


class Error(Exception):
    """Base of every error that the package raises on its own account.

    Examples:
        >>> import sdfrs
        >>> try:
        ...     sdfrs.sphere(-1)
        ... except sdfrs.Error as error:
        ...     print(type(error).__name__)
        SceneError
    """


class SceneError(Error, ValueError):
    """A shape, camera, ray or setting that cannot be: asked, got, allowed.

    Examples:
        >>> import sdfrs
        >>> issubclass(sdfrs.SceneError, ValueError)
        True
    """


class FormatError(Error, ValueError):
    """A file that is not what it says; the message holds the path inside it.

    Examples:
        >>> import sdfrs
        >>> issubclass(sdfrs.FormatError, sdfrs.Error)
        True
    """


class MissingFileError(Error, FileNotFoundError):
    """A file to be read that is not there, or a folder to be written to.

    Examples:
        >>> import sdfrs
        >>> try:
        ...     sdfrs.mesh_to_sdf_texture("no such mesh.obj")
        ... except sdfrs.Error as error:
        ...     print(isinstance(error, FileNotFoundError), error)
        True no file 'no such mesh.obj'
    """


class MeshError(Error, ValueError):
    """A mesh that cannot be baked, or asked for what cannot be; names the file and the element.

    Examples:
        >>> import sdfrs
        >>> issubclass(sdfrs.MeshError, ValueError)
        True
    """


class DeviceError(Error, RuntimeError):
    """A device that this machine does not have, or that failed: what was asked, found, and how to get it.

    Examples:
        >>> import sdfrs
        >>> try:
        ...     sdfrs.render(sdfrs.sphere(), sdfrs.Camera.look_at(width=8, height=8), device="cuda")
        ... except sdfrs.DeviceError as error:
        ...     print(str(error)[:54])
        device: asked for "cuda", allowed: "auto", "cpu", "gpu
    """


class InternalError(Error, RuntimeError):
    """A fault of the package itself, caught before it could end the process.

    Please report it, with the scene that led to it.

    Examples:
        >>> import sdfrs
        >>> issubclass(sdfrs.InternalError, RuntimeError)
        True
    """


class LipschitzWarning(UserWarning):
    """A traced field was steeper than its declared bound; names the factor to declare.

    Examples:
        >>> import sdfrs
        >>> issubclass(sdfrs.LipschitzWarning, UserWarning)
        True
    """


_ALL = (Error, SceneError, FormatError, MissingFileError, MeshError, DeviceError, InternalError, LipschitzWarning)
for _class in _ALL:
    _class.__module__ = "sdfrs"
del _class, _ALL
