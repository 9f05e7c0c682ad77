"""Detector: network and weights, and its file."""

from __future__ import annotations

import io
import os
import pickle
import struct
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from seip_addon.core.base.errors import SeipError
from seip_addon.core.storage.array_file import READ_ERRORS
from seip_addon.core.storage.files import digest, whole_file

from .centre_head import CentreHead
from .network import FeatureMap
from .pillars import Pillars
from .settings import NetworkSettings

SCHEMA, VERSION = "seip.detector", 3
SHIPPED_DETECTOR = Path(__file__).with_name("shipped_detector.pt")
"""Trained by `make detector` on random placements at random sites."""

_SEED_LOCK = threading.Lock()  # all threads share the generator of random numbers from which torch draws weights
_READ_ERRORS = (*READ_ERRORS, AssertionError, ImportError, pickle.UnpicklingError, struct.error)
"""Errors that torch raises on reading files that it has not written, or that lack expected values."""


@dataclass(frozen=True)
class TrainingRecord:
    """Sensor types and sites in the training of a detector.

    Parameters
    ----------
    sensors : tuple of str
        Catalogue keys of the sensor types, in alphabetical order; empty if unknown.
    sites : tuple of str
        Names of the sites, in alphabetical order; empty if unknown.
    """

    sensors: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()

    def merged_with(self, other: TrainingRecord) -> TrainingRecord:
        """Return the union of both records, for a detector whose training continues from another detector."""
        return TrainingRecord(*(tuple(sorted({*getattr(self, f.name), *getattr(other, f.name)})) for f in fields(self)))


class Detector(nn.Module):
    """PointPillars, for foreground returns with heights above the road.

    Parameters
    ----------
    seed : int
        Seed of the initial weights.
    training_record : TrainingRecord
        Sensor types and sites in its training.

    Examples
    --------
    >>> detector = Detector(NetworkSettings(width=8, blocks=(0, 0, 0)), training_record=TrainingRecord(("vlp16",)))
    >>> detector.save("detector.pt")
    >>> read = Detector.load("detector.pt")
    >>> read.key == detector.key, read.settings.width, read.training_record.sensors
    (True, 8, ('vlp16',))
    """

    def __init__(
        self,
        settings: NetworkSettings,
        seed: int = 0,
        training_record: TrainingRecord = TrainingRecord(),
    ) -> None:
        super().__init__()
        self.settings, self.training_record = settings, training_record
        with _SEED_LOCK, torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.feature_map = FeatureMap(settings)
            channels = self.feature_map.channels
            self.head = CentreHead(channels, settings.width)
        self.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # torch types do not know it

    @property
    def device(self) -> torch.device:
        """Device of the weights."""
        return next(self.parameters()).device

    def forward(self, pillars: Pillars, shape: tuple[int, int, int]) -> Tensor:
        """Return the head's output for a batch of clouds.

        Parameters
        ----------
        pillars : Pillars
            Pillars of all clouds of the batch.
        shape : (int, int, int)
            Number of clouds, and rows and columns of the pillar grid of each.
        """
        features = torch.from_numpy(pillars.features).to(self.device)
        pillar = torch.from_numpy(pillars.pillar).to(self.device)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=has_bfloat16(self.device)):
            output: Tensor = self.head(self.feature_map(features, pillar, shape))
        return output.float()

    @property
    def key(self) -> str:
        """Digest of weights and settings."""
        weights = [part for name, value in self.state_dict().items() for part in (name, value.cpu().numpy())]
        return digest(repr(self.settings), *weights)

    def save(self, path: str | os.PathLike[str], *, half: bool = False) -> None:
        """Write settings and weights; the same detector gives the same bytes.

        Parameters
        ----------
        half : bool
            Whether matrices are rounded to 16 bits, for a file of half the size.
        """
        weights = {
            name: value.half() if half and value.ndim > 1 else value for name, value in self.state_dict().items()
        }
        save_state(path, {**self.description(), "weights": weights})

    def description(self) -> dict[str, Any]:
        """Return the settings and the training record as plain values."""
        found: dict[str, Any] = _interned(
            {"settings": asdict(self.settings), "experience": asdict(self.training_record)}
        )
        return found

    @classmethod
    def load(cls, path: str | os.PathLike[str], device: str = "cpu") -> Detector:
        """Read a detector from its file, or from the file of an unfinished training.

        Raises
        ------
        SeipError
            The file cannot be read, is damaged, is not a detector, or has a different version.
        """
        state = load_state(path)
        with reading_detector(path):
            known = dict(state["settings"])
            known.pop("head", None)  # files of earlier versions name one of two heads
            settings = NetworkSettings(**{**known, "blocks": tuple(known["blocks"])})
            experience = {name: tuple(names) for name, names in state["experience"].items()}
            detector = cls(settings, training_record=TrainingRecord(**experience))
            detector.load_state_dict(state["weights"])
        return detector.to(device).eval()


def suitability_warnings(detector: Detector, sensors: Sequence[str], site: str) -> tuple[str, ...]:
    """Return warnings about using a detector beyond the types and the sites that it was trained on.

    Parameters
    ----------
    sensors : sequence of str
        Catalogue keys of the types whose clouds it is used on.
    site : str
        Name of the site, or "".
    """
    found = (_of_types(detector, sensors), _of_site(detector, site))
    return tuple(sentence for sentence in found if sentence)


def _of_types(detector: Detector, sensors: Sequence[str]) -> str:
    trained, foreign = detector.training_record.sensors, sorted(set(sensors) - set(detector.training_record.sensors))
    if not trained or not foreign:
        return ""
    return (
        f"the detector was trained on clouds of {' and '.join(trained)}, not of {' and '.join(foreign)}: "
        "test it on clouds of these types before you trust it with them, or train it on them too"
    )


def _of_site(detector: Detector, site: str) -> str:
    sites = detector.training_record.sites
    if not site or len(sites) != 1 or site in sites:
        return ""
    return (
        f"the detector was trained only at {sites[0]}, not at {site}: at other sites it may find less than the "
        "shipped detector, which was trained at many sites"
    )


def has_bfloat16(device: torch.device) -> bool:
    """Return whether a device multiplies 16-bit numbers (bfloat16) faster than 32-bit numbers."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    return device.type == "cpu" and torch.cpu._is_avx512_bf16_supported()  # noqa: SLF001  # there is no other way


def check_device(device: str) -> None:
    """Check that PyTorch can use a device.

    Raises
    ------
    SeipError
        PyTorch cannot use it.
    """
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise SeipError(f"PyTorch cannot use the device {device!r}: choose cpu, or repair its driver") from error


def save_state(path: str | os.PathLike[str], state: Mapping[str, Any]) -> None:
    """Write plain values and tensors; equal values give equal bytes."""
    # In memory first: torch.save writes the name of a file into its bytes, and leaves it open if the disk is full.
    content = io.BytesIO()
    # pickle writes an object that occurs twice only once. Interning makes equal texts one object, so that the bytes
    # depend on the values and not on how the texts were made.
    torch.save(_interned({"schema": SCHEMA, "version": VERSION, **state}), content)
    with whole_file(path) as temporary:
        temporary.write_bytes(content.getvalue())


def load_state(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a file of `save_state`, with tensors on the CPU.

    Raises
    ------
    SeipError
        The file cannot be read, is damaged, is not a detector, or has a different version.
    """
    if not Path(path).is_file():
        raise SeipError(f"detector {path} cannot be read: check its path")
    with reading_detector(path):
        state: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
        known = (state["schema"], state["version"]) == (SCHEMA, VERSION)
    if not known:
        raise SeipError(f"{path} is not a detector of this version of the program: train it again")
    return state


@contextmanager
def reading_detector(path: str | os.PathLike[str]) -> Iterator[None]:
    """Report errors raised in the block as a damaged detector file."""
    try:
        yield
    except SeipError as error:
        raise SeipError(f"{path} is not a detector file, or is damaged ({error}): train it again") from error
    except _READ_ERRORS as error:
        raise SeipError(f"{path} is not a detector file, or is damaged: train it again") from error


def _interned(value: Any) -> Any:  # noqa: ANN401  # plain values of any kind
    """Return nested values with equal texts as one object; tuples become lists."""
    if isinstance(value, str):
        return sys.intern(value)
    if isinstance(value, Mapping):
        return {_interned(key): _interned(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_interned(part) for part in value]
    return value
