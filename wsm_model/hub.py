"""Models on the Hugging Face Hub, or in a folder where there is no network."""

import shutil
from pathlib import Path

from huggingface_hub import HfApi, snapshot_download
from huggingface_hub.errors import HfHubHTTPError, HFValidationError, LocalEntryNotFoundError, OfflineModeIsEnabled

from wsm_data.errors import ConfigError
from wsm_data.schema.latent_standard import LatentStandard
from wsm_model.model import WorldSlamModel
from wsm_model.model_file import CARD_FILE, WEIGHTS_FILE, ModelCard, load_card, load_model, require_weights
from wsm_model.precision import Precision

_FILES = (WEIGHTS_FILE, CARD_FILE)
_REFUSALS = (HfHubHTTPError, HFValidationError, LocalEntryNotFoundError, OfflineModeIsEnabled, ConnectionError)


def from_pretrained(
    place: str,
    *,
    revision: str | None = None,
    standard: LatentStandard | None = None,
    precision: Precision = Precision.FLOAT32,
) -> tuple[WorldSlamModel, ModelCard]:
    """Read a model, in evaluation mode.

    Args:
        place: folder of a model, or a repository of the Hub, `owner/name`; what was fetched once is kept by the Hub's
            own cache, and is found there without a network.
        revision: of a repository; None: its newest.
        standard: of the latents it is to be used on; None where that is checked by the caller.
        precision: how its matrices are kept in memory.

    Raises:
        ConfigError: there is no such model, or it is one of other latents.
        IntegrityError: its files are damaged.
    """
    if is_folder(place):
        return load_model(Path(place), standard, precision)
    try:
        folder = snapshot_download(place, revision=revision, allow_patterns=list(_FILES))
    except _REFUSALS as error:
        raise ConfigError(f"{place} must be a folder of a model or a repository that can be read: {error}") from error
    return load_model(Path(str(folder)), standard, precision)


def push_to_hub(folder: Path, place: str, *, private: bool = False) -> str:
    """Put a model into a repository of the Hub, which is made if need be, or into a folder.

    The files are compared with their card before anything is sent.

    Args:
        folder: of the model.
        place: `owner/name`, or a folder: a path that begins with `/`, `.` or `~`.
        private: whether a new repository is.

    Returns:
        Where it is now.

    Raises:
        ConfigError: there is no model, or the Hub refuses; says why.
        IntegrityError: its files are damaged.
    """
    require_weights(folder, load_card(folder))
    if is_folder(place):
        target = Path(place).expanduser()
        target.mkdir(parents=True, exist_ok=True)
        (target / CARD_FILE).unlink(missing_ok=True)  # a folder without its card holds no model
        for name in _FILES:
            shutil.copyfile(folder / name, target / name)
        return str(target)
    api = HfApi()
    try:
        api.create_repo(place, private=private, exist_ok=True)
        sent = api.upload_folder(repo_id=place, folder_path=folder, allow_patterns=list(_FILES))
    except _REFUSALS as error:
        raise ConfigError(
            f"{place} must be a repository that can be written, but: {error}; log in with `hf auth login`, or give a "
            "folder, such as ./model, where there is no network"
        ) from error
    return str(sent)


def is_folder(place: str) -> bool:
    """Whether a place is a folder, by how it is spelled or because it is there."""
    return place.startswith(("/", ".", "~")) or Path(place).is_dir()
