"""Download of MERL files: resumable, verified, whole or absent."""

import hashlib
import http.client
import os
import shutil
import urllib.parse
import urllib.request
from pathlib import Path

from neumat.brdf.merl import SUFFIX
from neumat.errors import NeumatError

TIMEOUT = 60  # seconds without a byte


def download_merl(names, url_template, folder, sha256, progress=iter):
    """Download materials into `folder` as NAME.binary and return their paths.

    `url_template` holds {name}; `sha256` is {name: (hex digest, bytes)}; `progress` wraps the list of names
    (tqdm). A file that is already there and right is kept. A download goes to NAME.binary.part, from where an
    interrupted one resumes, and takes its name once digest and size are right; one that is wrong is tried
    again once. Raises NeumatError for an unknown name, a failed download, and a file already there with
    another content.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in progress(names):
        if name not in sha256:
            raise NeumatError("names of materials to download", "names with a known sha256", repr(name))
        paths.append(folder / f"{name}{SUFFIX}")
        _download(url_template.replace("{name}", urllib.parse.quote(name)), paths[-1], *sha256[name])
    return paths


def _download(url, path, digest, size):
    expected = f"{size} bytes with sha256 {digest}"
    if path.exists():
        found = _describe(path)
        if found != expected:
            raise NeumatError(path, f"{expected} (move the file away to download it again)", found)
        return
    part = path.with_name(f"{path.name}.part")
    for _attempt in range(2):
        problem = ""
        try:
            if not part.exists() or part.stat().st_size < size:
                _fetch(url, part)
        except (OSError, http.client.HTTPException, ValueError) as error:
            problem = f" ({type(error).__name__}: {error})"
        found = _describe(part) if part.exists() else "nothing"
        if found == expected:
            os.replace(part, path)
            return
        if part.exists() and part.stat().st_size >= size:
            part.unlink()  # wrong content: nothing to resume
    raise NeumatError(path, f"{expected} from {url}", found + problem)


def _fetch(url, part):
    """Append to `part` what the server still has to send; start over where it does not support ranges."""
    start = part.stat().st_size if part.exists() else 0
    request = urllib.request.Request(url, headers={"Range": f"bytes={start}-"} if start else {})
    with urllib.request.urlopen(request, timeout=TIMEOUT) as response:
        mode = "ab" if response.status == http.client.PARTIAL_CONTENT else "wb"
        with part.open(mode) as file:
            shutil.copyfileobj(response, file, 1 << 20)


def _describe(path):
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return f"{path.stat().st_size} bytes with sha256 {digest}"
