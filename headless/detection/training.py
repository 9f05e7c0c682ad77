"""Training of a detector on many configurations of sensors at once.

Every step takes windows about road users, each from a configuration, a frame and a place drawn by the seed and the
number of the step: a training that was stopped goes on as if it had not been.
"""

from __future__ import annotations

import math
import multiprocessing
import os
from collections.abc import Generator, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import Progress
from seip_addon.core.storage.files import digest
from seip_addon.core.storage.source_digest import source_digest

from .average_precision import evaluate
from .centre_head import TrainingTargets
from .detection_area import DetectionArea
from .detector import Detector, load_state, reading_detector, save_state
from .frame_results import EvaluatedBoxes, FrameResult, GroundTruth
from .frames import SampledRecording, TrainingSample, drawn, require_separate, spread, training_record_of
from .inference import detect_on_level
from .matching import Rule
from .pillars import PillarGrid, Pillars, fill_pillars, grid_over, stacked
from .settings import BOTTOM, CLASS_CATEGORIES, TOP, NetworkSettings, TrainingSettings

VALIDATION_FRAMES = 18  # frames of each validation, spread over the recordings set aside
LOSS_MARGIN = 1.6  # metres at the border of a window for which no loss is computed: much of what is there lies outside
MAX_CROP_SHIFT = 0.25  # share of a window that it lies beside its road user at most
MAX_ROTATION, MAX_STRETCH = math.radians(8.0), 0.05  # of training samples; the rotation is in addition to quarter turns
MAX_LIFT = 0.15  # metres by which all of a window is raised or lowered at most: a road is not known exactly
MAX_GRADIENT_NORM = 10.0  # norm beyond which a gradient is cut, as published


@dataclass(frozen=True)
class LearningCurve:
    """Training loss of each step, and validation precision by step.

    Parameters
    ----------
    loss : list of float
        Total loss of step i.
    validation : dict of int to float
        Average precision on the validation frames, at `matching.Rule`'s overlap, by number of steps.
    """

    loss: list[float] = field(default_factory=list)
    validation: dict[int, float] = field(default_factory=dict)

    @property
    def best(self) -> int:
        """Steps after which the average precision was highest for the first time."""
        return max(self.validation, key=lambda step: (self.validation[step], -step))


def train(  # noqa: PLR0913  # data, settings, device and initial weights
    recordings: Sequence[SampledRecording],
    validation: Sequence[SampledRecording],
    network: NetworkSettings,
    settings: TrainingSettings,
    *,
    device: str = "cpu",
    store: str | os.PathLike[str] | None = None,
    start: Detector | None = None,
) -> Generator[Progress, None, tuple[Detector, LearningCurve]]:
    """Train a PointPillars detector until its precision on recordings set aside stops growing.

    Parameters
    ----------
    recordings, validation : sequence of SampledRecording
        Training and validation recordings, of one site or of several, from separate runs of traffic.
    device : str
        PyTorch device: ``cpu``, ``cuda``.
    store : path, optional
        Checkpoint: written at each validation; training resumes from it if it exists.
    start : Detector, optional
        Whose weights the training begins with, in place of random ones.

    Yields
    ------
    Progress
        Step by step, with the loss.

    Returns
    -------
    detector : Detector
        Detector as it was when it did best on the frames set aside: the same bytes for the same arguments, on one kind
        of processor; not on a GPU.
    curve : LearningCurve
        Loss and precision by step.

    Raises
    ------
    SeipError
        Runs overlap, there is no frame, or ``store`` holds another training, or one of another version.
    """
    splits = {"training": recordings, "validation": validation}
    require_separate({what: [sampled.recording for sampled in some] for what, some in splits.items()})
    run = _Run(recordings, validation, network, settings, device, start)
    if run.detector.device.type == "cpu":  # torch lacks a fixed order of sums for pillars on a GPU
        make_deterministic(settings.threads)
    if store is not None and Path(store).exists():
        run.restore(store)
    yield run.progress()
    batches = run.batches()
    while not run.done:
        run.advance(next(batches))
        if run.step % settings.validate_every == 0 or run.step == settings.steps:
            run.validate()
            if store is not None:
                run.store(store)
        yield run.progress()
    return run.result()


_Batch = tuple[Pillars, dict[str, Tensor]]  # pillars of the windows of a step, and their training targets


class _Run(Dataset[_Batch]):
    """State of a running training, and its batches by the number of their step."""

    def __init__(
        self,
        recordings: Sequence[SampledRecording],
        validation: Sequence[SampledRecording],
        network: NetworkSettings,
        settings: TrainingSettings,
        device: str,
        start: Detector | None,
    ) -> None:
        self.settings = settings
        self.training_set, self.aside = _with_frames(recordings), _with_frames(validation)
        training_record = training_record_of([sampled.recording for sampled in self.training_set])
        if start is not None:
            training_record = training_record.merged_with(start.training_record)
        self.detector = Detector(network, settings.seed, training_record).to(device)
        sources = [(one.recording, len(one)) for one in (*self.training_set, *self.aside)]
        self.key = digest(
            source_digest("headless.detection"),
            repr((self.detector.description(), settings)),
            "" if start is None else start.key,
            repr([(one.name, one.traffic, one.placement, count) for one, count in sources]),
        )
        if start is not None:
            self.detector.load_state_dict(start.state_dict())
        self.optimiser = torch.optim.AdamW(
            self.detector.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.schedule = torch.optim.lr_scheduler.OneCycleLR(
            self.optimiser, settings.learning_rate, total_steps=settings.steps + 1
        )
        half = settings.window / 2
        self.window = grid_over((-half, -half, half, half), (BOTTOM, TOP), network.pillar)
        self.step = 0
        self.curve = LearningCurve()
        self.best = _copied(self.detector.state_dict())

    @property
    def done(self) -> bool:
        """Whether the training has ended."""
        waited = sum(step > self.curve.best for step in self.curve.validation)
        return self.step >= self.settings.steps or waited >= self.settings.patience

    def __len__(self) -> int:
        return self.settings.steps

    def __getitem__(self, step: int) -> _Batch:
        # A generator for each step, not one for the training: a resumed training draws the same samples as one that was
        # not interrupted, without storing the generator's state, and so do processes that make batches side by side.
        settings, random = self.settings, np.random.default_rng([self.settings.seed, 1, step])
        samples = [drawn(self.training_set, random) for _ in range(settings.batch)]
        varied = [vary(sample, self.window, random, settings.least_points) for sample in samples]
        most = self.detector.settings.most_points
        pillars = stacked([fill_pillars(one.points, self.window, most) for one in varied], self.window)
        targets = [_targets(one, settings.least_points) for one in varied]
        return pillars, self.detector.head.target_maps(targets, self.window, LOSS_MARGIN)

    def batches(self) -> Iterator[_Batch]:
        """Return the batches of the remaining steps; other processes make them ahead for a GPU."""
        # Forked processes share the samples, which others would copy; Windows has none.
        forks = self.detector.device.type == "cuda" and "fork" in multiprocessing.get_all_start_methods()
        loader: DataLoader[_Batch] = DataLoader(
            self,
            batch_size=None,
            sampler=range(self.step, self.settings.steps),
            num_workers=max(1, (os.cpu_count() or 1) - 1) if forks else 0,
            multiprocessing_context="fork" if forks else None,
            generator=torch.Generator(),  # else the loader draws from the generator of the whole process
        )
        return iter(loader)

    def advance(self, batch: _Batch) -> None:
        """Do one step."""
        self.detector.train()
        pillars, maps = batch
        output = self.detector(pillars, (self.settings.batch, self.window.rows, self.window.columns))
        maps = {name: values.to(self.detector.device) for name, values in maps.items()}
        loss = torch.stack(list(self.detector.head.loss(output, maps, self.window).values())).sum()
        self.optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.detector.parameters(), MAX_GRADIENT_NORM)
        self.optimiser.step()
        self.schedule.step()
        self.curve.loss.append(float(loss.detach()))
        self.step += 1

    def validate(self) -> None:
        """Take the average precision on the frames set aside, which are always the same."""
        results = [
            result_of_sample(self.detector, area, sample) for area, sample in spread(self.aside, VALIDATION_FRAMES)
        ]
        # Road users with too few points are not counted, as they are no targets of the training either.
        rule = Rule(fewest_points=self.settings.least_points)
        self.curve.validation[self.step] = evaluate(results, rule).average_precision
        if self.curve.best == self.step:
            self.best = _copied(self.detector.state_dict())

    def progress(self) -> Progress:
        """Return the progress, with the loss."""
        what = "train"
        if self.curve.loss:
            what += f", loss {np.mean(self.curve.loss[-20:]):.2f}"
        if self.curve.validation:
            what += f", validation AP {100 * next(reversed(self.curve.validation.values())):.1f} %"
        return Progress(self.step, self.settings.steps, what)

    def result(self) -> tuple[Detector, LearningCurve]:
        """Return the best detector so far."""
        self.detector.load_state_dict(self.best)
        return self.detector.eval(), self.curve

    def store(self, path: str | os.PathLike[str]) -> None:
        """Write all that is needed to go on, and the best weights so far as those of a detector."""
        # The best weights are stored like those of a detector, so that the file can be loaded as one at any time; the
        # latest weights, with the state of the optimiser, are for resuming.
        save_state(
            path,
            {
                **self.detector.description(),
                "weights": _copied(self.best),
                "training": {
                    "key": self.key,
                    "step": self.step,
                    "curve": asdict(self.curve),
                    "weights": _copied(self.detector.state_dict()),
                    "optimiser": self.optimiser.state_dict(),
                    "schedule": self.schedule.state_dict(),
                },
            },
        )

    def restore(self, path: str | os.PathLike[str]) -> None:
        """Continue from a stored training."""
        state = load_state(path)
        earlier = state.get("training", {})
        if not isinstance(earlier, dict) or earlier.get("key") != self.key:
            raise SeipError(
                f"{path} is of a training with other settings or recordings, or of another version of the program: "
                "delete it, or choose another file"
            )
        with reading_detector(path):
            self.step = int(earlier["step"])
            self.curve = LearningCurve(**earlier["curve"])
            self.best = state["weights"]
            self.detector.load_state_dict(earlier["weights"])
            self.optimiser.load_state_dict(earlier["optimiser"])
            self.schedule.load_state_dict(earlier["schedule"])


def _with_frames(recordings: Sequence[SampledRecording]) -> list[SampledRecording]:
    filled = [recording for recording in recordings if len(recording)]
    if not filled:
        raise SeipError("there is no frame to learn from: simulate some first")
    return filled


def vary(
    sample: TrainingSample, window: PillarGrid, random: np.random.Generator, least_points: int = 0
) -> TrainingSample:
    """Return what a window about a random road user shows, moved to the window and varied.

    Half of the windows are about any road user with ``least_points`` returns,
    half about one of a class that is as likely as the others there are: trucks
    and buses are rare. It is turned by quarters of a circle and a little more,
    mirrored, stretched and lifted: streets may run anywhere, and vehicles are
    of all sizes.
    """
    size = window.columns * window.pillar
    focus = np.array(window.centre)
    any_of = np.flatnonzero(sample.returns >= least_points)
    if len(any_of):
        if random.integers(2):
            category = sample.category[any_of]
            any_of = any_of[category == random.choice(np.unique(category))]
        focus = sample.boxes[random.choice(any_of), :2]
    focus = focus + random.uniform(-MAX_CROP_SHIFT, MAX_CROP_SHIFT, 2) * size
    angle = random.integers(4) * math.pi / 2 + random.uniform(-MAX_ROTATION, MAX_ROTATION)
    mirrored = bool(random.integers(2))
    scale = float(random.uniform(1 - MAX_STRETCH, 1 + MAX_STRETCH))
    lift = float(random.uniform(-MAX_LIFT, MAX_LIFT))

    # Mirroring (y → −y) comes before the rotation, so that a yaw becomes angle − yaw.
    matrix = scale * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    if mirrored:
        matrix = matrix @ np.diag((1.0, -1.0))
    # Half of the window's diagonal, enlarged by the strongest shrinking, reaches its corners at any rotation. Points
    # are sorted by x, so a binary search avoids a pass over the whole cloud; the mask below makes a copy, so that
    # changing its coordinates does not change the sample.
    reach = size * math.sqrt(0.5) / (1 - MAX_STRETCH)
    first, last = np.searchsorted(sample.points[:, 0], (focus[0] - reach, focus[0] + reach))
    points = sample.points[first:last]
    points = points[np.abs(points[:, 1] - focus[1]) <= reach]
    middle = np.array(window.centre)
    points[:, :2] = (points[:, :2] - focus) @ matrix.T + middle
    points[:, 2] = points[:, 2] * scale + lift

    boxes = sample.boxes.copy()
    boxes[:, :2] = (boxes[:, :2] - focus) @ matrix.T + middle
    boxes[:, 2:6] *= scale
    boxes[:, 2] += lift
    boxes[:, 6] = angle + (-boxes[:, 6] if mirrored else boxes[:, 6])
    seen = (np.abs(boxes[:, :2] - middle) <= size / 2).all(axis=1)
    return TrainingSample(points, boxes[seen], sample.category[seen], sample.returns[seen])


def result_of_sample(detector: Detector, area: DetectionArea, sample: TrainingSample) -> FrameResult:
    """Return what a detector finds in a sample, all of which counts, beside what is there."""
    found = detect_on_level(detector, area.grid, sample.points)
    names = np.array([members[0] for members in CLASS_CATEGORIES.values()], dtype=np.str_)
    return FrameResult(
        run="",
        time=0.0,
        truth=GroundTruth(
            boxes=sample.boxes,
            category=names[sample.category],
            points=sample.returns,
            visibility=np.ones(len(sample.boxes)),
            inside=np.ones(len(sample.boxes), dtype=np.bool_),
            distance=np.zeros(len(sample.boxes)),
            parked=np.zeros(len(sample.boxes), dtype=np.bool_),
        ),
        detected=EvaluatedBoxes(
            boxes=found.boxes,
            score=found.score,
            category=names[found.category],
            points=np.zeros(len(found), dtype=np.int64),
            density=np.zeros(len(found)),
            inside=np.ones(len(found), dtype=np.bool_),
            distance=np.zeros(len(found)),
        ),
    )


def _targets(sample: TrainingSample, least_points: int) -> TrainingTargets:
    return TrainingTargets(
        boxes=torch.from_numpy(sample.boxes.astype(np.float32)),
        category=torch.from_numpy(sample.category),
        learnable=torch.from_numpy(sample.returns >= least_points),
    )


def _copied(state: dict[str, Any]) -> dict[str, Tensor]:
    return {name: value.detach().clone() for name, value in state.items()}


def make_deterministic(threads: int) -> None:
    """Have torch do every sum in the same order, every time, from now on and in all threads of the process."""
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # what CUDA asks for to do so
    torch.set_num_threads(threads)
    # `torch.use_deterministic_algorithms` sets the same, but first imports torch's compiler, which is slow.
    torch.set_deterministic_debug_mode("error")
    # filling memory is a debugging aid, and takes a tenth
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]  # torch types lack it
