"""Recordings of one and several sensors: folders, times, pairs and packets."""

from dataclasses import dataclass

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.recordings.recording import Recording, open_recording, paired
from seip_addon.core.sensing.recordings.sensor_recording import SensorRecording
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
    assert sensor.sweep(1).time == 0.2
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
    refused("several formats, .bin and .pcd.bin", sweeps(tmp_path / "nuscenes", "a.bin", "b.pcd.bin"))
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


# --- packets of Ouster sensors


@dataclass
class Packets:
    path: object
    ranges: list
    reflectivity: list
    info: object


@pytest.fixture
def packets(tmp_path):
    core = pytest.importorskip("ouster.sdk.core", reason="pip install ouster-sdk")
    from ouster.sdk import pcap  # noqa: PLC0415

    random = np.random.default_rng(0)
    info = core.SensorInfo.from_default(core.LidarMode._512x10)  # noqa: SLF001  # its public name
    config = info.config
    config.udp_port_lidar, config.udp_port_imu = 7502, 7503
    info.config = config
    made = Packets(tmp_path / "os1.pcap", [], [], info)
    sent = []
    for number in range(3):
        frame = core.LidarFrame(info)
        frame.frame_id = number + 10
        frame.status[:] = 1
        frame.measurement_id[:] = np.arange(frame.w)
        frame.timestamp[:] = 10**18 + number * 10**8 + np.arange(frame.w) * 10**5
        made.ranges.append(random.integers(0, 2, (frame.h, frame.w)) * random.integers(500, 50_000, (frame.h, frame.w)))
        made.reflectivity.append(random.integers(0, 255, (frame.h, frame.w)))
        frame.field("RANGE")[:] = made.ranges[-1]
        frame.field("REFLECTIVITY")[:] = made.reflectivity[-1]
        for at, packet in enumerate(core.frame_to_packets(frame, core.PacketFormat(info), info.init_id, 0)):
            packet.host_timestamp = 10**18 + number * 10**8 + at * 10**6
            sent.append(packet)
    pcap.record(sent, str(made.path))
    made.path.with_suffix(".json").write_text(info.to_json_string())
    return made


def projected(packets, number):
    """Points (channels, columns, 3) by the formula of Ouster's software user manual, section "Sensor Data"."""
    info = packets.info
    beam = info.lidar_origin_to_beam_origin_mm / 1000
    along = packets.ranges[number] / 1000 - beam
    up = np.radians(info.beam_altitude_angles)[:, None]
    encoder = 2 * np.pi * (1 - np.arange(info.w) / info.w)
    around = encoder - np.radians(info.beam_azimuth_angles)[:, None]
    x = along * np.cos(around) * np.cos(up) + beam * np.cos(encoder)
    y = along * np.sin(around) * np.cos(up) + beam * np.sin(encoder)
    return np.stack([-x, -y, along * np.sin(up) + 0.03618], axis=-1)  # from the lidar's axes to the sensor's


def test_packets_of_an_ouster(packets):
    recording = open_recording(packets.path, rate=10.0)
    (sensor,) = recording.sensors
    assert (recording.name, sensor.name, len(sensor)) == ("os1", "os1", 3)
    assert sensor.times == pytest.approx([1e9, 1e9 + 0.1, 1e9 + 0.2], abs=1e-6)
    for number in (2, 0, 1):
        sweep = sensor.sweep(number)
        ring, column = np.nonzero(packets.ranges[number])
        assert (sweep.intensity == packets.reflectivity[number][ring, column]).all()
        np.testing.assert_allclose(sweep.points, projected(packets, number)[ring, column], rtol=0.0, atol=1e-5)
        assert sweep.time == sensor.times[number]


def test_damaged_packets(packets):
    content = packets.path.read_bytes()
    for part in (0, 10, 30):
        packets.path.write_bytes(content[: len(content) * part // 10_000])
        refused("not a readable recording of an Ouster sensor", packets.path)
    packets.path.with_suffix(".json").write_text("{}")
    packets.path.write_bytes(content)
    refused("not a readable recording of an Ouster sensor", packets.path)
    packets.path.with_suffix(".json").unlink()
    refused("put os1.json into the same folder", packets.path)


def test_metadata_that_are_not_json(tmp_path):
    (tmp_path / "os1.pcap").write_bytes(b"packets")
    (tmp_path / "os1.json").write_text("{", encoding="utf-8")
    refused("os1.json is not a sensor's metadata", tmp_path / "os1.pcap")
