"""Interface of a dataset format."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from .sample import Sample, TrafficRun


@dataclass(frozen=True)
class Format:
    """A format of datasets.

    Parameters
    ----------
    key : str
        What a user types.
    name : str
        For people.
    classes : mapping of str to str
        The format's name of each category of road users. One that is absent gets no label; empty for a format of
        clouds alone.
    sample_files : callable
        From a `Sample` to its files: by path in the dataset's folder, what gives the bytes.
    index_files : callable
        From the dataset's folder and the names of the samples by split to the bytes of the files of the dataset as a
        whole, by path; called when all samples are written.
    notes : callable
        From a `TrafficRun` to sentences that its users should know. Raises `SeipError` where the format cannot be
        written here.
    """

    key: str
    name: str
    classes: Mapping[str, str]
    sample_files: Callable[[Sample], Mapping[str, Callable[[], bytes]]]
    index_files: Callable[[Path, Mapping[str, Sequence[str]]], Mapping[str, bytes]] = lambda _folder, _splits: {}
    notes: Callable[[TrafficRun], tuple[str, ...]] = lambda _run: ()
