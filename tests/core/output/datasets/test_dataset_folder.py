"""What holds for every format: whole files, the manifest, runs and splits, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.output.datasets.dataset_folder import load_manifest, write_dataset
from seip_addon.core.output.datasets.formats import FORMATS
from tests.builders.scan_frames import contents, make_frame, make_frames, make_run, make_sensors, write

LABELLED = [key for key, kind in FORMATS.items() if kind.classes]
every_format = pytest.mark.parametrize("kind", list(FORMATS))


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
    next((tmp_path / "in two").rglob("000001.*")).unlink()
    write(kind, make_frames(), make_run(), tmp_path / "in two")
    assert contents(tmp_path / "in two") == contents(tmp_path / "at once")


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


@pytest.mark.parametrize("kind", LABELLED)
def test_every_label_is_written_or_counted_with_the_reason(kind, tmp_path):
    min_points = 5
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


@every_format
@pytest.mark.parametrize(("users", "static"), [(0, 0), (0, 9)])
def test_a_frame_may_be_without_labels_or_points(kind, users, static, tmp_path):
    entry = write(kind, make_frames(users=users, static=static), make_run(), tmp_path)
    assert entry["frames"] == 3


def refused(text, *arguments, **settings):
    with pytest.raises(SeipError, match=text) as caught:
        write(*arguments, **settings)
    assert "\n" not in str(caught.value)


def test_a_folder_that_cannot_be_one_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    refused("cannot write", "kitti", make_frames(), make_run(), tmp_path / "file")


def test_a_folder_holds_one_format_with_one_rule(tmp_path):
    write("kitti", make_frames(), make_run(), tmp_path)
    refused("in the format kitti", "openpcdet", make_frames(), make_run("b"), tmp_path)
    refused("with min_points 1", "kitti", make_frames(), make_run("b"), tmp_path, min_points=0)


def test_frames_do_not_leak_from_one_split_into_another(tmp_path):
    write("kitti", make_frames(), make_run("a", "train"), tmp_path)
    refused("are the same frames", "kitti", make_frames(), make_run("b", "test", key="key of a"), tmp_path)


@pytest.mark.parametrize("text", ["[]", '{"schema": "seip-dataset/0"}', '{"schema": "seip-dataset/1"}'])
def test_a_manifest_that_is_none_is_refused(text, tmp_path):
    (tmp_path / "manifest.json").write_text(text)
    refused(r"manifest\.json (is damaged|has the schema)", "kitti", make_frames(), make_run(), tmp_path)


def test_a_manifest_with_a_wrong_value_is_refused(tmp_path):
    write("kitti", make_frames(), make_run(), tmp_path)
    path = tmp_path / "manifest.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    record["runs"][0]["frames"] = 1.5
    path.write_text(json.dumps(record), encoding="utf-8")
    refused("manifest.json is damaged", "kitti", make_frames(), make_run("b"), tmp_path)


@pytest.mark.parametrize("name", ["", "..", "a/b", "ä\n"])
def test_names_that_cannot_be_files_are_refused(name, tmp_path):
    with pytest.raises(SeipError, match="cannot give its name to a file"):
        make_run(name)
    with pytest.raises(SeipError, match="cannot give its name to a file"):
        make_run(sensors=(replace(make_sensors()[0], label=name),))
    refused("cannot give its name to a file", "kitti", [(name, make_frame())], make_run(), tmp_path)
