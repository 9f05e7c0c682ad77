"""What holds for every format: whole files, the manifest, runs and splits, and what is refused."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.output.datasets.dataset_folder import load_manifest, write_dataset
from seip_addon.core.output.datasets.formats import FORMATS
from seip_addon.core.sensing.traffic.trajectories import CATEGORIES
from tests.builders.scan_frames import contents, make_frame, make_frames, make_run, make_sensors, write

LABELLED = [key for key, kind in FORMATS.items() if kind.classes]
NUMBERED = ["openpcdet", "mmdetection3d", "kitti"]
every_format = pytest.mark.parametrize("kind", list(FORMATS))


@every_format
def test_the_same_frames_give_the_same_bytes(kind, tmp_path):
    for folder in ("one", "two"):
        write(kind, make_frames(), make_run(), tmp_path / folder)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


@every_format
def test_the_manifest_knows_every_file_by_its_content(kind, tmp_path):
    write(kind, make_frames(), make_run(), tmp_path)
    manifest = load_manifest(tmp_path)
    run = manifest["runs"][0]
    known = dict(manifest["files"])
    for sample in run["samples"]:
        known |= sample["files"]
    there = contents(tmp_path)
    del there["manifest.json"]
    assert known == there
    assert manifest["versions"]["seip"]
    assert run["simulation"] == {"seeds": {"traffic": 3, "scans": 5}}
    assert [sensor["label"] for sensor in run["sensors"]] == ["S1", "S2"]
    assert [sample["time_s"] for sample in run["samples"]] == [0.0, 0.1, 0.2]


@every_format
def test_a_stopped_run_goes_on_and_ends_the_same(kind, tmp_path):
    write(kind, make_frames(), make_run(), tmp_path / "at once")
    steps = write_dataset(FORMATS[kind], make_frames(), make_run(), tmp_path / "in two")
    next(steps)
    steps.close()
    assert not load_manifest(tmp_path / "in two")["runs"][0]["finished"]
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "in two").rglob("000000.*")}
    assert kept
    write(kind, make_frames(), make_run(), tmp_path / "in two")
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert contents(tmp_path / "in two") == contents(tmp_path / "at once")


@every_format
def test_a_finished_run_is_not_even_read_again(kind, tmp_path):
    entry = write(kind, make_frames(), make_run(), tmp_path)
    assert write(kind, (pytest.fail("read") for _ in range(1)), make_run(), tmp_path) == json.loads(json.dumps(entry))


@every_format
def test_what_was_deleted_is_written_again(kind, tmp_path):
    write(kind, make_frames(), make_run(), tmp_path)
    before = contents(tmp_path)
    next(tmp_path.rglob("000001.*")).unlink()
    write(kind, make_frames(), make_run(), tmp_path)
    assert contents(tmp_path) == before


@every_format
def test_a_run_is_appended_without_touching_the_others(kind, tmp_path):
    write(kind, make_frames(1), make_run("a", "train"), tmp_path)
    before = {sample["name"]: sample["files"] for sample in load_manifest(tmp_path)["runs"][0]["samples"]}
    write(kind, make_frames(2), make_run("b", "val"), tmp_path)
    write(kind, make_frames(3, count=2), make_run("c", "train"), tmp_path)
    runs = load_manifest(tmp_path)["runs"]
    assert [(run["name"], run["split"], run["first"], run["frames"]) for run in runs] == [
        ("a", "train", 0, 3),
        ("b", "val", 3, 3),
        ("c", "train", 6, 2),
    ]
    assert {sample["name"]: sample["files"] for sample in runs[0]["samples"]} == before
    paths = [path for run in runs for sample in run["samples"] for path in sample["files"]]
    assert len(paths) == len(set(paths))


@pytest.mark.parametrize("kind", NUMBERED)
def test_a_split_lists_the_samples_of_its_runs(kind, tmp_path):
    for name, split in (("a", "train"), ("b", "val"), ("c", "train")):
        write(kind, make_frames(ord(name), count=2), make_run(name, split), tmp_path)
    sets = {path.stem: path.read_text().split() for path in (tmp_path / "ImageSets").iterdir()}
    assert sets == {"train": ["000000", "000001", "000004", "000005"], "val": ["000002", "000003"], "test": []}


@pytest.mark.parametrize("kind", LABELLED)
@pytest.mark.parametrize("min_points", [0, 1, 5])
def test_every_label_is_written_or_counted_with_the_reason(kind, min_points, tmp_path):
    frames = make_frames(4, count=5, users=20, outside=0.3)
    entry = write(kind, frames, make_run(), tmp_path, min_points=min_points)
    labels = [frame.labels for _, frame in frames]
    inside = np.concatenate([label.inside for label in labels])
    returns = np.concatenate([label.points.sum(axis=1) for label in labels])
    classed = np.isin(np.concatenate([label.category for label in labels]), list(FORMATS[kind].classes))
    assert entry["labels"] == {
        "written": (inside & classed & (returns >= min_points)).sum(),
        "outside_region": (~inside).sum(),
        "no_class": (inside & ~classed).sum(),
        "too_few_points": (inside & classed & (returns < min_points)).sum(),
    }
    assert sum(entry["classes"].values()) == entry["labels"]["written"]
    assert sum(sample["labels"] for sample in entry["samples"]) == entry["labels"]["written"]


def test_a_format_of_clouds_alone_counts_no_labels(tmp_path):
    assert write("pcd", make_frames(), make_run(), tmp_path)["labels"] == {}


@every_format
@pytest.mark.parametrize(("users", "static"), [(0, 0), (0, 9), (5, 0)])
def test_a_frame_may_be_without_labels_or_points(kind, users, static, tmp_path):
    entry = write(kind, make_frames(users=users, static=static), make_run(), tmp_path)
    assert entry["frames"] == 3


@pytest.mark.parametrize("key", LABELLED)
def test_classes_are_of_categories_that_exist(key):
    assert set(FORMATS[key].classes) == set(CATEGORIES)
    assert all(" " not in name for name in FORMATS[key].classes.values())


def refused(text, *arguments, **settings):
    with pytest.raises(SeipError, match=text) as caught:
        write(*arguments, **settings)
    assert "\n" not in str(caught.value)


@every_format
def test_a_folder_that_cannot_be_one_is_refused(kind, tmp_path):
    (tmp_path / "file").write_text("")
    refused("cannot write", kind, make_frames(), make_run(), tmp_path / "file" / "deeper")
    refused("cannot write", kind, make_frames(), make_run(), tmp_path / "file")


def test_a_folder_of_other_things_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    refused("holds other things", "kitti", make_frames(), make_run(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_folder_holds_one_format_with_one_rule(tmp_path):
    write("kitti", make_frames(), make_run(), tmp_path)
    refused("in the format kitti", "openpcdet", make_frames(), make_run("b"), tmp_path)
    refused("with min_points 1", "kitti", make_frames(), make_run("b"), tmp_path, min_points=0)


def test_a_run_stands_for_its_frames(tmp_path):
    write("kitti", make_frames(), make_run(), tmp_path)
    refused("of other frames", "kitti", make_frames(), make_run(key="another"), tmp_path)
    refused("in another split", "kitti", make_frames(), make_run(split="val"), tmp_path)
    shouted = make_run(make_run().name.upper())  # the same folder on many disks
    refused("has a run", "kitti", make_frames(), shouted, tmp_path)
    refused("of other frames", "kitti", make_frames(), replace(make_run(), origin=np.zeros(3)), tmp_path)


def test_frames_do_not_leak_from_one_split_into_another(tmp_path):
    write("kitti", make_frames(), make_run("a", "train"), tmp_path)
    refused("are the same frames", "kitti", make_frames(), make_run("b", "test", key="key of a"), tmp_path)


def test_a_half_written_run_comes_first(tmp_path):
    steps = write_dataset(FORMATS["kitti"], make_frames(), make_run("a"), tmp_path)
    next(steps)
    steps.close()
    refused("'a' .* is half-written", "kitti", make_frames(), make_run("b"), tmp_path)


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "null", '{"schema": "seip-dataset/0"}', '{"schema": "seip-dataset/1"}']
)
def test_a_manifest_that_is_none_is_refused(text, tmp_path):
    (tmp_path / "manifest.json").write_text(text)
    refused("manifest.json (is|lacks)", "kitti", make_frames(), make_run(), tmp_path)


def test_there_is_no_dataset_without_a_manifest(tmp_path):
    with pytest.raises(SeipError, match="there is no dataset in"):
        load_manifest(tmp_path)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\\b", ".hidden", "a b", "x" * 101, "ä\n"])
def test_names_that_cannot_be_files_are_refused(name, tmp_path):
    with pytest.raises(SeipError, match="cannot give its name to a file"):
        make_run(name)
    with pytest.raises(SeipError, match="cannot give its name to a file"):
        make_run(sensors=(replace(make_sensors()[0], label=name),))
    refused("cannot give its name to a file", "kitti", [(name, make_frame())], make_run(), tmp_path)


def test_sensors_and_splits_must_be_told_apart(tmp_path):
    one = make_sensors()[0]
    with pytest.raises(SeipError, match="two sensors are called 's1'"):
        make_run(sensors=(one, replace(one, label="s1")))
    with pytest.raises(SeipError, match="there is no split 'validation'"):
        make_run(split="validation")
    with pytest.raises(SeipError, match="has no sensors"):
        replace(make_run(), sensors=())
    refused("a sensor is called 'merged'", "pcd", [], make_run(sensors=(replace(one, label="Merged"),)), tmp_path)


def test_frames_must_be_of_the_sensors_and_in_order(tmp_path):
    frames = make_frames(sensors=3)
    refused("of other sensors than the 2", "kitti", frames, make_run(), tmp_path / "a")
    refused("comes after '000002'", "kitti", make_frames()[::-1], make_run(), tmp_path / "b")
    refused("has no frames", "kitti", [], make_run(), tmp_path / "c")


def test_nothing_but_whole_files_is_left_when_a_frame_fails(tmp_path):
    frames = itertools.chain(make_frames(count=1), (1 / 0 for _ in range(1)))
    with pytest.raises(ZeroDivisionError):
        write("openpcdet", frames, make_run(), tmp_path)
    assert sorted(contents(tmp_path)) == ["labels/000000.txt", "manifest.json", "points/000000.npy"]
