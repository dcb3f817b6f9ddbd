"""Weights that a new run begins with: those of a trained model, or of another run's checkpoint.

Weights alone are taken over: moments, schedule and place in the data are the new run's. What the weights mean is kept:
the model must have the same shape, and its latents are standardised as those that it learned from, whatever release
they come from.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from torch import Tensor, nn

from wsm_data.errors import ConfigError
from wsm_data.files.differences import differences
from wsm_model.config import ModelConfig
from wsm_model.model_file import CARD_FILE, WEIGHTS_FILE, ModelCard, load_card, require_weights
from wsm_model.training.checkpoint import checkpoints, fill, read_state, tensor_names

CHECKPOINTS = "checkpoints"
MODEL = "model"
"""Folders of a run."""


@dataclass(frozen=True, kw_only=True)
class InitialWeights:
    """Where weights lie, and what they are.

    Attributes:
        folder: of their safetensors files.
        prefix: what stands before the names of parameters there.
        card: of the model; its steps are those that the weights have.
    """

    folder: Path
    prefix: str
    card: ModelCard


def find_initial(path: Path) -> InitialWeights:
    """Look for weights in a model's folder, in a run's, or in that of one of its checkpoints.

    Of a run it is the model, or the last checkpoint where that has more steps. Of a checkpoint it is the averaged
    weights where there are any: those that its run evaluates and exports.

    Raises:
        ConfigError: there are none.
        IntegrityError: card or state are damaged.
    """
    if (path / CARD_FILE).is_file() and (path / WEIGHTS_FILE).is_file():
        return InitialWeights(folder=path, prefix="", card=load_card(path))
    if path.name.startswith("step-"):
        return _of_checkpoint(path)
    found = [_of_checkpoint(one) for one in checkpoints(path / CHECKPOINTS)[-1:]]
    if (path / MODEL / CARD_FILE).is_file():
        found.append(InitialWeights(folder=path / MODEL, prefix="", card=load_card(path / MODEL)))
    if not found:
        raise ConfigError(
            f"{path} must be the folder of a model, of a run of `wsm train`, or of a checkpoint, but it holds neither "
            f"{CARD_FILE} nor a finished checkpoint"
        )
    return max(found, key=lambda one: one.card.steps)


def _of_checkpoint(path: Path) -> InitialWeights:
    steps = read_state(path).step
    has_average = any(name.startswith("average.") for name in tensor_names(path))
    card = replace(load_card(path.parent), steps=steps)
    return InitialWeights(folder=path, prefix="average." if has_average else "model.", card=card)


def require_shape(initial: InitialWeights, wanted: ModelConfig) -> None:
    """Check that weights fit a model.

    Raises:
        ConfigError: they are those of another; says in which settings.
    """
    if lines := differences(asdict(initial.card.config), asdict(wanted)):
        raise ConfigError(
            "\n  ".join(
                [f"the weights in {initial.folder} are those of another model; choose its size and variant:", *lines]
            )
        )


def fill_from(model: nn.Module, initial: InitialWeights) -> None:
    """Give a model its first weights in place, sharded or not; each rank reads what it keeps.

    Raises:
        IntegrityError: they are damaged.
    """
    if not initial.prefix:
        require_weights(initial.folder, initial.card)
    tensors: Mapping[str, Tensor] = {
        f"{initial.prefix}{name}": parameter.detach() for name, parameter in model.named_parameters()
    }
    fill(initial.folder, tensors, vouched=bool(initial.prefix))
