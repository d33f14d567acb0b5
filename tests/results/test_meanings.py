"""What is kept of source files from one command to the next."""

import json

import pytest

from mpmbench.results import meanings
from mpmbench.results.private import cache_home


@pytest.mark.parametrize("same", (True, False))
def test_what_another_python_has_kept_is_not_taken(tmp_path, monkeypatch, same):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    file = tmp_path / "some.py"
    file.write_text("import mpmbench.say\nx = 1\n")
    name = meanings.hashlib.sha256(file.read_bytes()).hexdigest()
    stored = {"by": meanings.parser() if same else "3.0", "meanings": {name: ["stored", []]}}
    (cache_home() / meanings.FILE).write_text(json.dumps(stored))
    for cached in (meanings.kept, meanings.meaning):
        cached.cache_clear()
    digest, imported = meanings.meaning(file, 0)
    expected = ("stored", ()) if same else meanings.parsed(file.read_bytes())
    assert (digest, imported) == expected
    for cached in (meanings.kept, meanings.meaning):
        cached.cache_clear()
