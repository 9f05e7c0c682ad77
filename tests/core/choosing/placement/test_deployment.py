import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seip_addon.core.choosing.placement.deployment import deploy


def seen_by_hand(example, chosen):
    return [sum(bool(example.visible[pose, target]) for pose in chosen) for target in range(len(example.site.targets))]


@given(seed=st.integers(0, 10_000), count=st.integers(0, 6))
def test_shares_equal_counting_one_by_one(example, seed, count):
    chosen = np.random.default_rng(seed).choice(len(example.site.candidates), count, replace=False)
    deployment = deploy(example.site, example.models, example.visible[chosen], chosen)
    times = seen_by_hand(example, chosen)
    total = len(times)

    assert deployment.seen_by.tolist() == times
    assert deployment.coverage == pytest.approx(sum(n > 0 for n in times) / total)
    assert deployment.seen_twice == pytest.approx(sum(n > 1 for n in times) / total)
    central = [n > 0 for n, inside in zip(times, example.site.targets.central, strict=True) if inside]
    assert deployment.central == pytest.approx(sum(central) / len(central))
    assert sorted(sensor.pose for sensor in deployment.sensors) == sorted(chosen.tolist())
    assert sum(sensor.added for sensor in deployment.sensors) == pytest.approx(deployment.coverage)
    for sensor in deployment.sensors:
        others = [pose for pose in chosen if pose != sensor.pose]
        without = sum(n > 0 for n in seen_by_hand(example, others)) / total
        assert sensor.marginal == pytest.approx(deployment.coverage - without)
        assert sensor.alone == pytest.approx(example.visible[sensor.pose].mean())


def test_labels_go_by_what_each_adds(example):
    added = [sensor.added for sensor in example.deployment.sensors]
    assert added == sorted(added, reverse=True)
    assert [sensor.label for sensor in example.deployment.sensors] == ["S1", "S2", "S3"]


def test_without_weighted_regions_there_is_no_central_coverage(example):
    targets = example.site.targets
    outside = type(targets)(targets.xyz, np.ones(len(targets)), np.zeros(len(targets), bool), targets.spacing)
    site = type(example.site)(**{**vars(example.site), "targets": outside})
    deployment = deploy(site, example.models, example.visible[[0]], [0])
    assert deployment.central is None
    assert deployment.weighted == pytest.approx(deployment.coverage)
