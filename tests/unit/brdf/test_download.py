import hashlib
import http.server
import re
import threading

import pytest

from neumat.brdf.download import download_merl
from neumat.brdf.published import merl_checksums
from neumat.errors import NeumatError

BODY = bytes(range(256)) * 400
SHA256 = {name: (hashlib.sha256(BODY).hexdigest(), len(BODY)) for name in ("good", "cut", "wrong", "flaky")}


class Handler(http.server.BaseHTTPRequestHandler):
    """Serves `good` with ranges; `cut` ends early, `flaky` the first time only; `wrong` has another content."""

    def do_GET(self):
        name = re.fullmatch(r"/(\w+)\.binary", self.path)[1]
        asked = self.headers.get("Range")
        self.server.requests.append((name, asked))
        if name == "missing":
            return self.send_error(404)
        start = int(re.fullmatch(r"bytes=(\d+)-", asked)[1]) if asked and self.server.ranges else 0
        body = (bytes(len(BODY)) if name == "wrong" else BODY)[start:]
        self.send_response(206 if asked and self.server.ranges else 200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        first = sum(request[0] == name for request in self.server.requests) == 1
        self.wfile.write(body[: len(body) // 2] if name == "cut" or (name == "flaky" and first) else body)

    def log_message(self, *arguments):
        pass


@pytest.fixture
def server():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.requests, server.ranges = [], True
    server.url = f"http://127.0.0.1:{server.server_port}/{{name}}.binary"
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def download(server, folder, name):
    return download_merl([name], server.url, folder, SHA256)


def test_a_good_file_is_loaded_once(server, tmp_path):
    folder = tmp_path / "new" / "folder"
    assert download(server, folder, "good") == download(server, folder, "good") == [folder / "good.binary"]
    assert (folder / "good.binary").read_bytes() == BODY
    assert server.requests == [("good", None)]
    assert len(list(folder.iterdir())) == 1


@pytest.mark.parametrize("ranges", [True, False])
def test_an_interrupted_download_resumes_or_starts_over(server, tmp_path, ranges):
    server.ranges = ranges
    (tmp_path / "good.binary.part").write_bytes(BODY[:1000])
    download(server, tmp_path, "good")
    assert server.requests == [("good", "bytes=1000-")]
    assert (tmp_path / "good.binary").read_bytes() == BODY
    assert not (tmp_path / "good.binary.part").exists()


def test_a_connection_that_breaks_once_is_resumed(server, tmp_path):
    download(server, tmp_path, "flaky")
    assert [asked for _, asked in server.requests] == [None, f"bytes={len(BODY) // 2}-"]
    assert (tmp_path / "flaky.binary").read_bytes() == BODY


def test_a_part_with_wrong_content_is_dropped(server, tmp_path):
    for part in (bytes(1000), bytes(2 * len(BODY))):
        (tmp_path / "good.binary").unlink(missing_ok=True)
        (tmp_path / "good.binary.part").write_bytes(part)
        download(server, tmp_path, "good")
        assert (tmp_path / "good.binary").read_bytes() == BODY


@pytest.mark.parametrize(
    ("name", "found"),
    [("cut", f"{len(BODY) * 3 // 4} bytes"), ("wrong", hashlib.sha256(bytes(len(BODY))).hexdigest())],
)
def test_a_failure_names_file_expected_and_found(server, tmp_path, name, found):
    with pytest.raises(NeumatError) as caught:
        download(server, tmp_path, name)
    message = str(caught.value)
    assert "\n" not in message
    for part in (f"{name}.binary", SHA256[name][0], f"{len(BODY)} bytes", found):
        assert part in message
    assert len(server.requests) == 2  # retried once
    assert not (tmp_path / f"{name}.binary").exists()


def test_a_missing_file_and_a_dead_server(server, tmp_path):
    checksums = {"missing": SHA256["good"]}
    with pytest.raises(NeumatError, match="404"):
        download_merl(["missing"], server.url, tmp_path, checksums)
    with pytest.raises(NeumatError, match=r"good\.binary"):
        download_merl(["good"], "http://127.0.0.1:9/{name}", tmp_path, SHA256)
    with pytest.raises(NeumatError, match="unknown url type"):
        download_merl(["good"], "no-scheme/{name}", tmp_path, SHA256)


def test_a_users_file_of_the_same_name_is_not_overwritten(server, tmp_path):
    (tmp_path / "good.binary").write_text("precious")
    with pytest.raises(NeumatError, match="move the file away"):
        download(server, tmp_path, "good")
    assert (tmp_path / "good.binary").read_text() == "precious"
    assert not server.requests


def test_unknown_names(server, tmp_path):
    with pytest.raises(NeumatError, match="vibranium"):
        download(server, tmp_path, "vibranium")


def test_the_checksums_of_all_100():
    checksums = merl_checksums()
    assert len(checksums) == 100
    assert all(len(digest) == 64 and size == 34_992_012 for digest, size in checksums.values())
