"""Recordings of one and several sensors: folders, times and pairs."""

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.recordings.recording import Recording, SensorRecording, open_recording, paired
from tests.builders.recording_files import make_points, write_sweep_file
from tests.builders.scan_frames import make_frames, make_run, write


def sweeps(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names):
        write_sweep_file(folder / name, make_points(seed=number, count=20))
    return folder


def refused(words, path, rate=10.0):
    with pytest.raises(SeipError, match=words):
        open_recording(path, rate)


def test_a_folder_of_sweeps_is_one_sensor(tmp_path):
    folder = sweeps(tmp_path / "south", "10.bin", "9.bin", "2.bin")
    (folder / "notes.txt").write_text("taken in the rain")
    recording = open_recording(folder, rate=5.0)
    (sensor,) = recording.sensors
    assert (recording.name, sensor.name, len(sensor)) == ("south", "south", 3)
    assert [path.name for path in sensor.paths] == ["2.bin", "9.bin", "10.bin"]
    assert sensor.times.tolist() == [0.0, 0.2, 0.4]
    assert (sensor.sweep(2).points[:, 0] == make_points(seed=0, count=20)["x"]).all()


def test_a_folder_of_folders_is_several_sensors(tmp_path):
    sweeps(tmp_path / "S10", "a.csv", "b.csv")
    sweeps(tmp_path / "S2", "a.pcd")
    sweeps(tmp_path / "Merged", "a.pcd")
    (tmp_path / "labels").mkdir()
    recording = open_recording(tmp_path, rate=10.0)
    assert [(sensor.name, len(sensor)) for sensor in recording.sensors] == [("S2", 1), ("S10", 2)]


def test_a_simulated_dataset_is_a_recording_in_the_axes_of_its_sensors(tmp_path):
    run, frames = make_run(), make_frames()
    write("pcd", frames, run, tmp_path)
    recording = open_recording(tmp_path / "train" / "a", rate=10.0)
    assert [sensor.name for sensor in recording.sensors] == ["S1", "S2"]
    assert paired(recording) == [(0, 0), (1, 1), (2, 2)]
    for number, (mounted, sensor) in enumerate(zip(run.sensors, recording.sensors, strict=True)):
        for time, (_, frame) in enumerate(frames):
            own = (frame.points[frame.sensor == number] - mounted.xyz) @ mounted.orientation
            sweep = sensor.sweep(time)
            np.testing.assert_allclose(sweep.points, own, rtol=0.0, atol=1e-5)
            np.testing.assert_allclose(sweep.viewpoint[:3, :3], mounted.orientation, rtol=0.0, atol=1e-8)
            np.testing.assert_allclose(sweep.viewpoint[:3, 3], mounted.xyz, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("1.5\n2.25\n", (1.5, 2.25)),
        ("\ufeff2024-05-01T12:00:00Z\r\n2024-05-01T14:00:00.1+02:00\r\n", (1714564800.0, 1714564800.1)),
        ("2024-05-01 12:00:00.000000000\n2024-05-01 12:00:00.100000000\n\n", (1714564800.0, 1714564800.1)),
    ],
)
def test_times_in_a_file(text, times, tmp_path):
    folder = sweeps(tmp_path, "1688625741050.bin", "1688625741150.bin")
    (folder / "timestamps.txt").write_text(text, encoding="utf-8")
    assert open_recording(folder, rate=10.0).sensors[0].times == pytest.approx(times, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("has 1 times for 2 sweeps", "1\n"),
        ("time of b.bin is not after that of a.bin", "1\n1\n"),
        ("time of b.bin is not after that of a.bin", "2\n1\n"),
        ("neither seconds nor", "1\nnoon\n"),
        ("neither seconds nor", "1\n2024-13-01\n"),
        ("time of a sweep is nan", "nan\n1\n"),
        ("time of a sweep is 1e\\+300", "1\n1e300\n"),
        ("is empty", ""),
    ],
)
def test_wrong_times(words, text, tmp_path):
    folder = sweeps(tmp_path, "a.bin", "b.bin")
    (folder / "timestamps.txt").write_text(text)
    refused(words, folder)


def test_refused_folders(tmp_path):
    refused("no such file or folder", tmp_path / "none")
    refused("has no sweeps", tmp_path)
    (tmp_path / "a.txt").write_text("x")
    refused("is not a recording", tmp_path / "a.txt")
    refused("rate is 0", tmp_path, rate=0.0)
    refused("several formats, .bin and .pcd", sweeps(tmp_path / "mixed", "a.bin", "b.pcd"))
    refused("b.bin has no time in its name", sweeps(tmp_path / "named", "1688625741050.bin", "b.bin"))
    sweeps(tmp_path / "only" / "merged", "a.pcd")
    refused("has no sweeps", tmp_path / "only")


def recorded(*times):
    return Recording(
        "r", tuple(SensorRecording(f"S{at}", (), np.array(own, dtype=float)) for at, own in enumerate(times))
    )


def test_pairs_are_nearest_in_time():
    one, other = [0.0, 0.1, 0.2, 0.3], [0.04, 0.26]
    assert paired(recorded(one, other)) == [(0, 0), (1, None), (2, None), (3, 1)]
    assert paired(recorded(other, one)) == [(0, 0), (None, 1), (None, 2), (1, 3)]


def test_sensors_without_a_common_time():
    with pytest.raises(SeipError, match="S0 and S1 have no time in common"):
        paired(recorded([0.0, 0.1], [1e9, 1e9 + 0.1]))
