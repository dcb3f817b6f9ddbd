"""Where compiled kernels are kept when neither the package nor the home of the user can be written.

numba keeps them beside the source, or below the user's cache folder, and refuses to define a kernel where it can write
to neither: in a container that runs as another user, in a read-only image, in most CI. It reads NUMBA_CACHE_DIR when it
is imported, so this is settled when `wsm_data` is, and worker processes inherit it.
"""

import os
import stat
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


def settle_kernel_cache(package: Path) -> None:
    """Name a folder for numba's cache below the temporary folder, where numba would find none by itself.

    Args:
        package: folder of the sources that hold kernels.
    """
    if VARIABLE in os.environ or os.access(package, os.W_OK) or _can_be_written(_folder_of_the_user()):
        return
    os.environ[VARIABLE] = str(_temporary_folder())


def _folder_of_the_user() -> Path:
    """Where numba keeps kernels of sources that cannot be written."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")  # noqa: PTH111, PTH118
    return Path(home) / "numba"


def _can_be_written(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _temporary_folder() -> Path:
    """The user's own folder, kept from command to command; one for this process alone where it is not his alone.

    numba unpickles what it finds in its cache: nobody else may be able to put anything there.
    """
    import tempfile  # takes longer than all of the above, which most programs need

    folder = Path(tempfile.gettempdir()) / f"wsm-kernels-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="wsm-kernels-"))
    own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
    return folder if own else Path(tempfile.mkdtemp(prefix="wsm-kernels-"))
