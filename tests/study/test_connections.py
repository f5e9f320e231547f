"""Who can reach the processes of a study, and to whom it connects."""

import tempfile
from pathlib import Path

import psutil
import pytest

from pneumorph.errors import ProblemError
from pneumorph.study import cluster
from pneumorph.study.cluster import WORKER_MEMORY, connected, workers_for


def test_processes_on_this_machine_listen_on_the_loopback_interface_alone_and_leave_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with connected(None, 1) as client:
        me = psutil.Process()
        places = {
            each.laddr.ip
            for process in [me, *me.children(recursive=True)]
            for each in process.net_connections("inet")
            if each.status == psutil.CONN_LISTEN
        }
        assert places == {"127.0.0.1"}
        assert not any("bokeh" in str(service) for service in client.scheduler_info()["services"])
        (worker,) = client.run(lambda dask_worker: dask_worker.local_directory).values()
        assert Path(worker).is_relative_to(tmp_path) and Path(worker).exists()
    assert not list(tmp_path.iterdir())


class Named(Exception):
    """Stands for a connection that is tried."""


@pytest.fixture
def tried(monkeypatch):
    """What the client of Dask is given."""
    given = []

    def client(address, **options):
        given.append((address, options))
        raise Named

    monkeypatch.setattr(cluster, "Client", client)
    return given


def test_workers_follow_from_cores_and_memory():
    assert workers_for(2, 24_000_000_000) == 2
    assert workers_for(64, 8 * WORKER_MEMORY + 1) == 8
    assert workers_for(4, WORKER_MEMORY // 2) == 1


def test_files_for_tls_reach_dask(tried, tmp_path):
    files = {f"--tls-{name}": tmp_path / f"{name}.pem" for name in ("ca", "cert", "key")}
    for path in files.values():
        path.touch()
    with pytest.raises(Named), connected("tls://10.0.0.1:8786", None, files):
        pass
    ((address, options),) = tried
    security = options["security"]
    assert address == "tls://10.0.0.1:8786" and security.require_encryption
    assert security.tls_ca_file == str(files["--tls-ca"])
    assert security.tls_client_cert == str(files["--tls-cert"]) and security.tls_client_key == str(files["--tls-key"])


@pytest.mark.parametrize(
    ("address", "options", "said"),
    [
        ("", (), "is not an address; write tcp://"),
        ("10.0.0.1:8786", (), "is not an address; write tcp://"),
        (None, ("ca",), "--tls-ca: is for a scheduler at tls://"),
        ("tcp://10.0.0.1:8786", ("ca", "cert", "key"), "is for a scheduler at tls://"),
        ("tls://10.0.0.1:8786", ("ca", "key"), "--tls-ca, --tls-key: is not enough; give --tls-ca, --tls-cert"),
        ("tls://10.0.0.1:8786", ("ca", "cert", "key"), "there is no such file"),
    ],
)
def test_what_is_no_scheduler_of_the_user_is_refused(tried, tmp_path, address, options, said):
    files = {f"--tls-{name}": tmp_path / f"{name}.pem" for name in options}
    with pytest.raises(ProblemError) as caught, connected(address, 1, files):
        pass
    assert said in str(caught.value) and not tried


def test_a_scheduler_in_the_environment_is_not_asked(monkeypatch, tried):
    """Dask itself would connect to the address in this variable."""
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", "tcp://10.0.0.1:8786")
    with cluster.config.set({"scheduler-address": "tcp://10.0.0.1:8786"}), pytest.raises(Named), connected(None, 1):
        pass
    ((address, _),) = tried
    assert isinstance(address, cluster.LocalCluster) and address.scheduler_address.startswith("tcp://127.0.0.1:")
