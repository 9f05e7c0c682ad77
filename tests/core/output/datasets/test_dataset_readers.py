"""Each format, read back by the reader that its users use: the same points, the same boxes, each around its points.

What a reader's library does is done by the library where there is one to install: ``.ci/readers`` runs these tests
with all of them.
OpenPCDet, OpenCOOD and mmdetection3d cannot: there the test takes the steps that their documentation and sources
describe, and says which.
"""

import math
import pickle
import warnings

import numpy as np
import pytest
import yaml

from seip_addon.core.geometry.geo_reference import GeoReference
from tests.builders.scan_frames import ORIGIN, make_frame, make_frames, make_run, make_sensors, rotation, write

HALF_A_LEVEL = 0.5 / 255 + 1e-6
IN_FLOAT32 = 1e-5  # metres, of places within 100 m that a reader keeps in float32


def reader(name):
    """Import a reader; open3d and its kin warn of what they stand on, which is none of ours."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, reason=f"{name} is not here: .ci/readers runs this", exc_type=ImportError)


def kept(frame, excluded=()):
    labels = frame.labels
    return np.flatnonzero((labels.points.sum(axis=1) > 0) & ~np.isin(labels.category, list(excluded)))


def require_around(box_centre, box_size, turn, points):
    """The points lie in the box, given by its middle, its size and the rotation from its axes."""
    inside = np.abs((points - box_centre) @ turn) <= np.asarray(box_size) / 2
    assert inside.all()


def cloud(frame):
    return np.column_stack([frame.points, frame.intensity])


@pytest.fixture(params=range(3))
def frames(request):
    return make_frames(seed=request.param, count=3, users=14)


def test_openpcdet(frames, tmp_path):
    """CustomDataset.get_infos, get_lidar and __getitem__: read as float32, drop DontCare."""
    write("openpcdet", frames, make_run(), tmp_path)
    names = [line.strip() for line in (tmp_path / "ImageSets" / "train.txt").read_text().splitlines()]
    assert len(names) == len(frames)
    for name, (_, frame) in zip(names, frames, strict=True):
        points = np.load(tmp_path / "points" / f"{name}.npy")
        assert points.dtype == np.float32
        assert (points == cloud(frame)).all()
        rows = [line.strip().split(" ") for line in (tmp_path / "labels" / f"{name}.txt").read_text().splitlines()]
        boxes = np.array([row[:-1] for row in rows], dtype=np.float32)[:, :7]
        users = kept(frame)
        assert len(boxes) == len(users)
        for box, user in zip(boxes, users, strict=True):
            require_around(box[:3], box[3:6] + 1e-4, rotation(box[6]), points[frame.instance == user, :3])
            assert box == pytest.approx(
                [*frame.labels.centre[user], *frame.labels.size[user], frame.labels.yaw[user]], rel=1e-6, abs=1e-6
            )


def test_openpcdet_reads_a_frame_without_labels(tmp_path):
    """get_infos slices the boxes' columns, which fails where there is none; drop_info_with_name drops DontCare."""
    write("openpcdet", make_frames(users=0), make_run(), tmp_path)
    rows = [line.strip().split(" ") for line in (tmp_path / "labels" / "000000.txt").read_text().splitlines()]
    boxes, names = np.array([row[:-1] for row in rows], dtype=np.float32)[:, :7], np.array([row[-1] for row in rows])
    assert boxes[[number for number, name in enumerate(names) if name != "DontCare"]].shape == (0, 7)


def read_mmdetection3d(folder, frames):
    """What Det3DDataset.parse_ann_info and LoadPointsFromFile make of the information file's samples."""
    information = pickle.loads((folder / "custom_infos_train.pkl").read_bytes())  # noqa: S301  # written by the test
    assert len(information["data_list"]) == len(frames)
    return information["metainfo"], information["data_list"]


def require_mmdetection3d(folder, samples, frames, classes):
    for sample, (_, frame) in zip(samples, frames, strict=True):
        path = folder / "points" / sample["lidar_points"]["lidar_path"].rsplit("/", 1)[-1]
        points = np.fromfile(path, dtype=np.float32).reshape(-1, sample["lidar_points"]["num_pts_feats"])
        assert (points == cloud(frame)).all()
        users = kept(frame)
        assert len(sample["instances"]) == len(users)
        for instance, user in zip(sample["instances"], users, strict=True):
            x, y, bottom, *size, yaw = instance["bbox_3d"]
            require_around([x, y, bottom + size[2] / 2], size, rotation(yaw), points[frame.instance == user, :3])
            assert yaw == frame.labels.yaw[user]
            assert size == frame.labels.size[user].tolist()
            assert bottom == pytest.approx(frame.labels.centre[user, 2] - frame.labels.size[user, 2] / 2, abs=1e-12)
            name = next(name for name, number in classes.items() if number == instance["bbox_label_3d"])
            assert name.lower() == {"bicycle": "cyclist"}.get(frame.labels.category[user], frame.labels.category[user])


def test_mmdetection3d_by_its_documented_steps(frames, tmp_path):
    write("mmdetection3d", frames, make_run(), tmp_path)
    metainfo, samples = read_mmdetection3d(tmp_path, frames)
    require_mmdetection3d(tmp_path, samples, frames, metainfo["categories"])


def test_mmdetection3d_by_the_base_class_of_its_datasets(frames, tmp_path):
    pytest.importorskip("torch", reason="mmengine's datasets stand on torch")
    dataset = reader("mmengine.dataset")
    write("mmdetection3d", frames, make_run(), tmp_path)

    class Dataset(dataset.BaseDataset):
        def parse_data_info(self, raw_data_info):
            return raw_data_info

    found = Dataset(
        ann_file="custom_infos_train.pkl", data_root=str(tmp_path), data_prefix={"pts": "points"}, test_mode=True
    )
    samples = [found.get_data_info(number) for number in range(len(found))]
    assert found.metainfo["info_version"] == "1.1"
    require_mmdetection3d(tmp_path, samples, frames, found.metainfo["categories"])


def test_kitti_by_open3d_ml(frames, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        reader("open3d")
        kitti = reader("open3d._ml3d.datasets.kitti").KITTI
    write("kitti", frames, make_run(), tmp_path)
    found = kitti(str(tmp_path), cache_dir=str(tmp_path / "cache")).get_split("training")
    assert len(found) == len(frames)
    for number, (_, frame) in enumerate(frames):
        path = found.get_attr(number)["path"]
        points = found.dataset.read_lidar(path)
        assert (points == cloud(frame)).all()
        calibration = found.dataset.read_calib(path.replace("velodyne", "calib").replace(".bin", ".txt"))
        boxes = found.dataset.read_label(path.replace("velodyne", "label_2").replace(".bin", ".txt"), calibration)
        users = kept(frame)
        assert len(boxes) == len(users)
        for box, user in zip(boxes, users, strict=True):
            assert box.get_difficulty() >= 0
            corners = box.generate_corners3d() @ calibration["world_cam"][:3, :3].T
            lowest, highest = corners.min(axis=0), corners.max(axis=0)
            assert (lowest + highest) / 2 == pytest.approx(frame.labels.centre[user], abs=IN_FLOAT32)
            along = (corners[0] + corners[1] - corners[2] - corners[3]) / 2
            assert math.hypot(*along) == pytest.approx(frame.labels.size[user, 0])
            assert math.remainder(math.atan2(along[1], along[0]) - frame.labels.yaw[user], math.tau) == pytest.approx(
                0.0, abs=1e-9
            )
            require_around(
                box.center,
                frame.labels.size[user],
                rotation(-box.yaw - math.pi / 2),
                points[frame.instance == user, :3],
            )


def test_kitti_by_openpcdets_steps(frames, tmp_path):
    """KittiDataset.get_infos: calibration by line number, float32, rect_to_lidar, z raised by half the height."""
    write("kitti", frames, make_run(), tmp_path)
    for number, (_, frame) in enumerate(frames):
        stem = f"{number:06d}"
        lines = (tmp_path / "training/calib" / f"{stem}.txt").read_text().splitlines()
        rectify = np.array(lines[4].split(" ")[1:], dtype=np.float32).reshape(3, 3)
        to_camera = np.array(lines[5].split(" ")[1:], dtype=np.float32).reshape(3, 4)
        both = np.eye(4)
        both[:3] = rectify @ to_camera
        words = [line.split(" ") for line in (tmp_path / "training/label_2" / f"{stem}.txt").read_text().splitlines()]
        users = kept(frame)
        for row, user in zip(words, users, strict=True):
            height, width, length, *location, turn = map(float, row[8:15])
            xyz = np.array([*location, 1.0]) @ np.linalg.inv(both.T)
            box = [*xyz[:2], xyz[2] + height / 2, length, width, height]
            assert box == pytest.approx([*frame.labels.centre[user], *frame.labels.size[user]], abs=1e-12)
            points = frame.points[frame.instance == user]
            require_around(box[:3], box[3:], rotation(-(turn + math.pi / 2)), points)


def test_kitti_frame_without_labels_by_openpcdets_steps(tmp_path):
    """KittiDataset.get_infos concatenates boxes in the picture, of which there must be one; DontCare is dropped."""
    write("kitti", make_frames(users=0), make_run(), tmp_path)
    rows = [line.split(" ") for line in (tmp_path / "training/label_2/000000.txt").read_text().splitlines()]
    assert [(row[0], len(row)) for row in rows] == [("DontCare", 15)]


def test_pcd_by_open3d(frames, tmp_path):
    open3d = reader("open3d")
    write("pcd", frames, make_run(), tmp_path)
    for name, frame in frames:
        for folder, chosen in (("merged", slice(None)), ("S1", frame.sensor == 0), ("S2", frame.sensor == 1)):
            found = open3d.t.io.read_point_cloud(str(tmp_path / f"train/a/{folder}/{name}.pcd"))
            assert (found.point.positions.numpy() == frame.points[chosen]).all()
            assert (found.point.intensity.numpy()[:, 0] == frame.intensity[chosen]).all()


def test_pcd_by_pypcd4(frames, tmp_path):
    pypcd4 = reader("pypcd4")
    write("pcd", frames, make_run(), tmp_path)
    for name, frame in frames:
        found = pypcd4.PointCloud.from_path(tmp_path / f"train/a/merged/{name}.pcd")
        assert (found.numpy(("x", "y", "z", "intensity")) == cloud(frame)).all()


@pytest.mark.parametrize("kind", ["pcd", "opv2v"])
def test_an_empty_cloud_by_pypcd4(kind, tmp_path):
    pypcd4 = reader("pypcd4")
    write(kind, make_frames(users=0, static=0), make_run(), tmp_path)
    paths = list(tmp_path.rglob("*.pcd"))
    assert paths
    assert all(pypcd4.PointCloud.from_path(path).points == 0 for path in paths)


def pose_matrix(pose):
    """opencood.utils.transformation_utils.x_to_world, composed of its three turns."""
    x, y, z, roll, yaw, pitch = pose
    (cr, sr), (cy, sy), (cp, sp) = ((math.cos(a), math.sin(a)) for a in map(math.radians, (roll, yaw, pitch)))
    matrix = np.eye(4)
    matrix[:3, :3] = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, sr], [0, -sr, cr]])
    )
    matrix[:3, 3] = x, y, z
    return matrix


def opencood_agents(folder):
    """BaseDataset: folders as agents sorted by name, the first that is not negative as ego; yaml files sorted."""
    agents = sorted(path.name for path in folder.iterdir() if path.is_dir())
    assert int(agents[0]) >= 0
    return agents


def opencood_boxes(agents, name, folder, ego):
    """project_world_objects: each box from its own axes into the ego's, as a (4, 4) matrix and its half sizes."""
    objects = {}
    for agent in agents:
        objects.update(yaml.safe_load((folder / agent / f"{name}.yaml").read_text())["vehicles"])
    boxes = {}
    for user, found in objects.items():
        middle = np.add(found["location"], found["center"])
        boxes[user] = (np.linalg.inv(ego) @ pose_matrix([*middle, *found["angle"]]), np.array(found["extent"]))
    return boxes


def require_opencood(folder, frames, read_cloud, two_wheelers=("motorcycle", "bicycle", "pedestrian")):
    """EarlyFusionDataset: every agent's cloud and boxes in the ego's axes, boxes of several agents once."""
    agents = opencood_agents(folder)
    for name, frame in frames:
        poses = {agent: yaml.safe_load((folder / agent / f"{name}.yaml").read_text()) for agent in agents}
        ego = pose_matrix(poses[agents[0]]["lidar_pose"])
        boxes = opencood_boxes(agents, name, folder, ego)
        assert sorted(boxes) == kept(frame, two_wheelers).tolist()
        for number, agent in enumerate(agents):
            points, intensity = read_cloud(folder / agent / f"{name}.pcd")
            mine = frame.sensor == number
            to_ego = np.linalg.inv(ego) @ pose_matrix(poses[agent]["lidar_pose"])
            there = points @ to_ego[:3, :3].T + to_ego[:3, 3]
            world = (there @ ego[:3, :3].T + ego[:3, 3]) * [1, -1, 1]
            assert world == pytest.approx(frame.points[mine], abs=1e-4)
            assert intensity == pytest.approx(frame.intensity[mine], abs=HALF_A_LEVEL)
            for user, (box, half) in boxes.items():
                own = there[frame.instance[mine] == user]
                require_around(box[:3, 3], 2 * half, box[:3, :3], own)
            seen = np.flatnonzero(frame.labels.points[:, number])
            assert set(poses[agent]["vehicles"]) == set(seen) & set(boxes)
        for user, (_, half) in boxes.items():
            assert 2 * half == pytest.approx(frame.labels.size[user], abs=1e-8)
        for agent in agents:
            for user, found in poses[agent]["vehicles"].items():
                assert found["speed"] == pytest.approx(frame.labels.speed[user] * 3.6, abs=1e-8)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_opv2v_by_opencoods_steps_with_pypcd4(frames, tilt, tmp_path):
    pypcd4 = reader("pypcd4")

    def read(path):
        found = pypcd4.PointCloud.from_path(path)
        packed = np.ascontiguousarray(found.pc_data["rgb"]).view(np.uint32)
        return found.numpy(("x", "y", "z")).astype(float), ((packed >> 16) & 255) / 255

    write("opv2v", frames, make_run(sensors=make_sensors(2, tilt)), tmp_path)
    require_opencood(tmp_path / "train" / "a", frames, read)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_opv2v_by_opencoods_steps_with_open3d(tilt, tmp_path):
    """opencood.utils.pcd_utils.pcd_to_np: points, and the first of the colours as intensity."""
    open3d = reader("open3d")

    def read(path):
        found = open3d.io.read_point_cloud(str(path))
        return np.asarray(found.points), np.asarray(found.colors)[:, 0]

    sloping = make_frames(5, count=3, users=14, sensors=3, pitch=0.1)
    write("opv2v", sloping, make_run(split="val", sensors=make_sensors(3, tilt)), tmp_path)
    require_opencood(tmp_path / "validate" / "a", sloping, read)


def test_an_empty_cloud_by_open3d(tmp_path):
    open3d = reader("open3d")
    write("opv2v", make_frames(users=0, static=0, count=1), make_run(), tmp_path)
    found = open3d.io.read_point_cloud(str(tmp_path / "train/a/0/000000.pcd"))
    assert np.asarray(found.points).shape == (0, 3)
    assert np.asarray(found.colors)[:, 0].shape == (0,)


def test_las_by_laspy(frames, tmp_path):
    laspy = reader("laspy")
    reader("lazrs")
    write("las", frames, make_run(), tmp_path)
    for name, frame in frames:
        found = laspy.read(tmp_path / f"train/a/{name}.laz")
        assert found.header.are_points_compressed
        assert (str(found.header.version), found.header.point_format.id) == ("1.4", 6)
        assert found.header.creation_date is None
        expected = frame.points.astype(np.float64) + ORIGIN
        assert np.abs(found.xyz - expected).max(initial=0) <= 0.0005 + 1e-9
        assert (found.intensity == np.round(frame.intensity * 65535)).all()
        assert (found.point_source_id == frame.sensor + 1).all()
        assert (found.instance == frame.instance).all()
        assert (found.gps_time == frame.time + frame.delay.astype(float)).all()
        assert (np.array(found.return_number) == 1).all()


@pytest.mark.parametrize(
    ("projection", "code"), [("+proj=utm +zone=32", "32632"), ("+proj=tmerc +lat_0=52.5 +lon_0=13.4", None)]
)
def test_las_says_where_on_the_earth_it_is(frames, tmp_path, projection, code):
    laspy = reader("laspy")
    reader("lazrs")
    place = GeoReference(projection, (500_000.0, 5_000_000.0, 30.0, 0.0))
    write("las", frames, make_run(geo_reference=place), tmp_path)
    name, frame = frames[0]
    path = tmp_path / f"train/a/{name}.laz"
    found = laspy.read(path)
    expected = frame.points.astype(np.float64) + ORIGIN + (500_000.0, 5_000_000.0, 30.0)
    assert np.abs(found.xyz - expected).max() <= 0.0005 + 1e-9
    assert found.header.global_encoding.wkt
    (record,) = [one for one in found.header.vlrs if one.user_id == "LASF_Projection"]
    content = record.record_data_bytes()
    assert (record.record_id, content[-1:], content.count(b"\0")) == (2112, b"\0", 1)
    text = content[:-1].decode("ascii")
    assert text.startswith('PROJCS["WGS 84 / ')
    assert text.count("[") == text.count("]")
    assert (f'AUTHORITY["EPSG","{code}"]]' in text) is (code is not None)
    assert 'PARAMETER["central_meridian",' in text


def test_las_of_a_map_without_a_projection_claims_none(frames, tmp_path):
    laspy = reader("laspy")
    reader("lazrs")
    write("las", frames, make_run(geo_reference=GeoReference("+proj=merc")), tmp_path)
    found = laspy.read(tmp_path / f"train/a/{frames[0][0]}.laz")
    assert not [one for one in found.header.vlrs if one.user_id == "LASF_Projection"]
    assert np.abs(found.xyz - frames[0][1].points.astype(np.float64) - ORIGIN).max() <= 0.0005 + 1e-9


def test_an_empty_cloud_by_laspy(tmp_path):
    laspy = reader("laspy")
    reader("lazrs")
    write("las", [("0", make_frame(users=0, static=0))], make_run(), tmp_path)
    assert len(laspy.read(tmp_path / "train/a/0.laz")) == 0
