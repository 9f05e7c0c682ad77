"""Work on a cluster: the same grid whatever the number of workers, and though workers die."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.sensing.visibility.grid import compute_visibility
from seip_addon.core.sensing.visibility.settings import VisibilitySettings
from seip_addon.core.sensing.visibility.store import stored_visibility
from tests.builders.synthetic_junction import junction_site
from tests.engines import ANY, needs_embree

HAS_DASK = importlib.util.find_spec("distributed") is not None
needs_dask = pytest.mark.skipif(not HAS_DASK, reason="Dask is not installed: the group 'cluster' of pyproject.toml")
SITE = junction_site(positions=60, heights=[4.0, 6.0], spacing=2.0)
MODELS = load_catalogue()
SETTINGS = VisibilitySettings()


@pytest.fixture
def cluster() -> Iterator[object]:
    from distributed import LocalCluster  # noqa: PLC0415 - an extra that need not be installed

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        silence_logs=50,
    ) as started:
        yield started


@needs_dask
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://"])
def test_a_scheduler_that_does_not_answer_has_its_sentence(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seip_addon.core.programs.dask_client._CONNECT_TIMEOUT", 0.5)
    with pytest.raises(SeipError, match="no Dask scheduler answers at"):
        finish(compute_visibility(SITE, MODELS, SETTINGS, ANY, scheduler=address))


@needs_dask
@needs_embree
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")
def test_an_encrypted_cluster_is_reached_with_the_certificates_of_dasks_settings(tmp_path: Path) -> None:
    import dask  # noqa: PLC0415 - an extra that need not be installed
    from distributed import LocalCluster  # noqa: PLC0415 - as above
    from distributed.security import Security  # noqa: PLC0415 - as above

    key, certificate = str(tmp_path / "key.pem"), str(tmp_path / "certificate.pem")
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=127.0.0.1"]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True)  # noqa: S603  # our own
    files = {"ca-file": certificate}
    files |= {
        f"{who}.{what}": file
        for who in ("client", "scheduler", "worker")
        for what, file in (("cert", certificate), ("key", key))
    }
    settings = {f"distributed.comm.tls.{name}": file for name, file in files.items()}
    with (
        dask.config.set({**settings, "distributed.comm.require-encryption": True}),
        LocalCluster(
            n_workers=1,
            processes=False,
            dashboard_address="127.0.0.1:0",
            host="127.0.0.1",
            protocol="tls",
            security=Security(),
        ) as started,
    ):
        assert started.scheduler_address.startswith("tls://")
        there = finish(compute_visibility(SITE, MODELS, SETTINGS, "embree", scheduler=started.scheduler_address))
    here = finish(compute_visibility(SITE, MODELS, SETTINGS, "embree"))
    assert (there.packed == here.packed).all()


@needs_dask
@needs_embree
@pytest.mark.slow
def test_a_cluster_writes_the_same_bytes_though_a_worker_dies(cluster, tmp_path: Path) -> None:
    def grid(name: str, scheduler: str | None):
        return stored_visibility(tmp_path / name, SITE, MODELS, SETTINGS, "embree", scheduler)

    finish(grid("here.npz", None))
    finish(grid("there.npz", cluster.scheduler_address))
    assert (tmp_path / "there.npz").read_bytes() == (tmp_path / "here.npz").read_bytes()

    steps = grid("hurt.npz", cluster.scheduler_address)
    killed = False
    for progress in iter(lambda: next(steps, None), None):
        if progress.done and not killed:
            os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
            killed = True
    assert killed
    assert (tmp_path / "hurt.npz").read_bytes() == (tmp_path / "here.npz").read_bytes()
    assert not (tmp_path / "hurt.pieces").exists()
